"""What a page sees of a run: samples of its present, and all that happens.

The thread of the run notes values that do not change any more. Their texts, which are those of a
recording, are made in the thread of the link, for what is sampled only.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any, Protocol

from specc_runtime.changes import Event
from specc_runtime.clock import WallClock
from specc_runtime.examination import shortcomings
from specc_runtime.forms import Layout, Schema
from specc_runtime.live import Change
from specc_runtime.options import Options
from specc_runtime.page.control import Control, steered
from specc_runtime.page.link import Link
from specc_runtime.page.pictures import Picture, Pictures
from specc_runtime.panel import Operation, Panel
from specc_runtime.plant import Posed
from specc_runtime.processes.worker import glimpse
from specc_runtime.recording.cells import Cells, Shelf
from specc_runtime.recording.log import Texts
from specc_runtime.recording.scene import scene_of
from specc_runtime.recording.steps import Steps, topic_of
from specc_runtime.recording.text import dumped
from specc_runtime.records import StepRecord
from specc_runtime.requirement import Requirement
from specc_runtime.sampling import PLANT, Onlooker
from specc_runtime.system import System
from specc_runtime.timing import Timing

_PERIOD_S, _PAUSED_S, _IDLE_S = 0.05, 0.25, 1.0
"""Wall time between two samples at least, of a run that is paused, and while nobody looks."""
_WHOLE_S = 0.09
"""Wall time between two samples of more than poses: every second one."""
_MOST_CHANGES = 2000
"""Changes of states that wait for the next sample."""
_PICTURE_WEIGHT = 500
"""Of a picture, among all that waits to be sent: a slow server has few of them waiting."""
_DECIMALS = 5
Moment = tuple[float, Any]
"""The time of a message and its content."""


class LastTwo:
    """Takes messages of a topic, see `Sink`, and has the last two of them."""

    def __init__(self, texts: Texts) -> None:
        self.texts = texts
        self.pair: tuple[Moment | None, Moment | None] = (None, None)

    def add(self, time_s: float, content: Any) -> None:
        """See `Sink`."""
        self.pair = self.pair[1], (time_s, content)


class Topics(dict[str, LastTwo]):
    """Stands for a recording: has the last messages of each topic, see `Sinks`."""

    def channel(
        self,
        topic: str,
        schema: str,
        form: Schema,
        texts: Texts = lambda contents, *_: contents,
        *,
        is_preceded: bool = False,
    ) -> LastTwo:
        """See `Sinks`."""
        return self.setdefault(topic, LastTwo(texts))


class NoImages(Shelf):
    """Nothing is stored aside: images and opaque values are left out.

    `see` is told of images: their topics, times and values.
    """

    def __init__(self, see: Callable[[str, float, Any], None] = lambda *_: None) -> None:
        super().__init__(None, exact=False)
        self._see = see

    def image(self, value: Any) -> Any:
        """See `Aside`."""
        self._see(self._topic, self._time_s, value)
        return {"image": ""}


class LiveSubsystem:
    """A subsystem as the page sees it, see `specc_runtime.recording.moment.Seen`."""

    def __init__(self, steps: Steps, last: LastTwo) -> None:
        self.steps = steps
        self.last = last
        self.entered_s: float | None = None
        self.since_s: float | None = None
        self.row = ""
        self._rows = [str(row) for row in steps.subsystem.transitions]

    def add(self, record: StepRecord) -> bool:
        """Note a committed step; whether it has entered a state."""
        self.steps.add(record)
        self.entered_s = self.since_s
        if record.transition < 0 and (self.since_s is not None or record.stamp > 0):
            return False
        self.since_s = record.time_s
        self.row = self._rows[record.transition] if record.transition >= 0 else ""
        return True

    def fail(self, stamp: int, time_s: float, message: str) -> None:
        """Note the step that ended in a fault."""
        before, self.entered_s = self.last.pair[1], self.since_s
        self.steps.failed(stamp, time_s, message)
        if self.last.pair[1] is not before and self.steps.subsystem.state != _state(before):
            self.since_s, self.row = time_s, ""  # it failed after its row

    @property
    def present(self) -> tuple[Any, ...]:
        """What its text is made from."""
        return (*self.last.pair, self.entered_s, self.since_s, self.row)

    def text(
        self,
        before: Moment | None,
        last: Moment | None,
        entered_s: float | None,
        since_s: float | None,
        row: str,
    ) -> bytes:
        """The text of what was present at some time."""
        assert last is not None
        (time_s, content), memory = last, b"null"
        step = next(iter(self.last.texts([content], [time_s], [0])))
        if before is not None:
            memory = self.steps.memory_text(*before)
        others = {"entered_s": entered_s, "since_s": since_s, "row": row, "stamp": content[1]}
        return b'{"step":%b,"memory":%b,%b' % (step, memory, dumped(others)[1:])


def _state(moment: Moment | None) -> str:
    """The state of a step, from its message."""
    return "" if moment is None else str(moment[1][0][1])


class Run(Protocol):
    """What a page asks of a run."""

    duration_s: float | None
    wanted: int | None

    @property
    def time_s(self) -> float:
        """Simulated time."""

    @property
    def requirements(self) -> Sequence[Requirement]:
        """All of them."""

    def entered(self) -> Mapping[str, float]:
        """When each subsystem entered its state."""

    def set_constant(self, name: str, value: float, by: str) -> None:
        """Change a live constant."""

    @property
    def panel(self) -> Panel:
        """The operator's panel."""

    @property
    def live(self) -> Mapping[str, float]:
        """The values of live constants."""

    def cycles(self) -> Sequence[Mapping[str, Any]]:
        """As in the report."""

    def late(self) -> Mapping[str, tuple[float, int]]:
        """How late the last step of each subsystem began, in s, and the periods it has skipped."""


class Feed:
    """Shows one run: an observer of its records, called after every base tick."""

    def __init__(
        self,
        link: Link,
        control: Control,
        options: Options,
        system: System,
        layouts: Mapping[str, Layout],
        plant: Any,
        clock: WallClock,
    ) -> None:
        """Note the steps of a system that is not running yet."""
        self.has_clients = False
        self.wants_scene = False
        self._link, self._control, self._options, self._system = link, control, options, system
        self._clock, self._plant = clock, plant
        self._pictures = Pictures(plant, layouts, clock, self._refuse)
        shelf, topics = NoImages(self._pictures.see), Topics()
        self._seen: dict[str, LiveSubsystem] = {}
        for subsystem in (scheduled.subsystem for scheduled in system.subsystems):
            name, layout = subsystem.name, layouts[subsystem.name]
            is_apart = name in options.apart
            steps = Steps(subsystem, glimpse(layout) if is_apart else layout, shelf, topics)
            self._seen[name] = LiveSubsystem(steps, topics[topic_of(name)])
        self._truth = _truth_of(system, plant, layouts)
        self._posed: Posed | None = None
        if plant is not None and not shortcomings(plant, Posed):
            self._posed = plant
        self._run: Run
        self._changes: list[tuple[str, float, str, str]] = []
        self._marks: list[dict[str, Any]] = []
        self._known = _Known()
        self._next_s = 0.0
        self._before: tuple[float, float] | None = None
        """Wall time and simulated time from which on the pace is measured."""
        self._factor: float | None = None
        self._whole_s = -_IDLE_S
        """The wall time of the last sample of the whole that was sent."""
        self._paused_at = -1
        self._poses: Any = None
        self._values: Sequence[tuple[str, Callable[[], bytes]]] = ()
        control.on_stop = self._stop

    # What comes of it.

    def timing(self, clock: WallClock, is_over: Callable[[], bool]) -> Timing:
        """How the run follows the clock."""
        return steered(self._control, self._plant, clock, is_over, self._pause)

    def _pause(self) -> None:
        """The run is paused."""
        if self._clock.now_s() >= self._next_s or self._paused_at != self._control.version:
            self._paused_at = self._control.version
            self.sample("paused")

    @property
    def beats(self) -> int:
        """A number that changes while the run is paused."""
        return self._control.beats

    def begin(self, run: Run) -> None:
        """The run is about to begin, or to go on."""
        self._run = run
        if run.time_s > 0.0:
            for name, entered_s in run.entered().items():
                seen = self._seen[name]
                seen.since_s = entered_s
                self._changes.append((name, entered_s, seen.steps.subsystem.state, ""))
        self._known.note(run, self._system.tick_s)
        data = self._beginning(run)
        scene = b"null"
        if self._posed is not None:
            scene = dumped(scene_of(self._posed))
        self._link.post(b'%b,"scene":%b}' % (dumped(data)[:-1], scene), 0)

    def _beginning(self, run: Run) -> dict[str, Any]:
        options, system, steered = self._options, self._system, not self._options.real_time
        return {
            "kind": "begin",
            "tick_s": system.tick_s,
            "seed": options.seed,
            "real_time": options.real_time,
            "begin_s": run.time_s,
            "repeats_until_s": self._control.hurries_until_s,
            "duration_s": run.duration_s,
            "cycles": run.wanted,
            "set": dict(options.built_with),
            "exact": False,
            "subsystems": [
                {"name": s.subsystem.name, "period_s": s.subsystem.period_s}
                for s in system.subsystems
            ],
            "bodies": list(self._posed.body_names()) if self._posed is not None else [],
            "cameras": list(self._pictures.cameras),
            "live": [
                {
                    "name": one.name,
                    "unit": one.unit,
                    "least": one.least,
                    "greatest": one.greatest,
                    "value": run.live[one.name],
                    "whole": type(one.initial) is int,
                }
                for one in system.live
            ],
            "panel": [asdict(each) for each in system.panel],
            "can": {"pause": steered, "restart": steered},
        }

    def __call__(self, record: StepRecord) -> None:
        """See a committed step."""
        seen = self._seen[record.subsystem]
        if seen.add(record):
            self._changes.append((record.subsystem, record.time_s, record.state, seen.row))
        self._control(record)

    def watch(self, wishes: Mapping[str, Any]) -> None:
        """Show what is looked at; any thread may ask."""
        self.has_clients = bool(wishes.get("clients"))
        self.wants_scene = bool(wishes.get("scene"))
        cameras = wishes.get("cameras")
        named = cameras if isinstance(cameras, list) else []
        self._pictures.wanted([name for name in named if isinstance(name, str)])
        self._next_s = 0.0

    def changed(self, change: Event, time_s: float) -> None:
        """A constant has changed, or the panel was operated."""
        if isinstance(change, Change):
            self.mark("change", time_s, f"{change.constant} = {change.value:g}, by the {change.by}")
        elif isinstance(change, Operation):
            self.mark("panel", time_s, f"{change.element} = {change.value}, by the {change.by}")

    def mark(self, kind: str, time_s: float, text: str) -> None:
        """Something has happened."""
        self._marks.append({"time_s": time_s, "kind": kind, "text": text})

    def _stop(self, why: str) -> None:
        """A breakpoint has been reached, or the end of a step."""
        time_s = self._run.time_s
        self.mark("break", time_s, why)
        self._link.post(dumped({"kind": "stopped", "why": why, "time_s": time_s}))

    def tick(self) -> None:
        """A base tick is over."""
        self._control.look()
        is_full = len(self._changes) >= _MOST_CHANGES
        if is_full or self._clock.now_s() >= self._next_s:
            self.sample("running", whole=is_full)

    def sample(self, status: str, *, whole: bool = True) -> None:
        """Show the present; unless it is to be the `whole`, mostly only what moves."""
        run, now_s = self._run, self._clock.now_s()
        period_s = _PAUSED_S if status == "paused" else _PERIOD_S
        self._next_s = now_s + (period_s if self.has_clients else _IDLE_S)
        self._measure(status, now_s, run.time_s)
        if status != "ended":  # else the plant is closed
            self._poses = self._poses_of(self._posed)
            for picture in self._pictures.take(run.time_s):
                self._link.post(partial(_picture_text, picture), _PICTURE_WEIGHT)
        state = {
            "kind": "state",
            "time_s": run.time_s,
            "wall_s": now_s,  # which signs of life send back
            "status": status,
            "speed": self._control.speed,
            "factor": self._factor,
            "poses": self._poses,
        }
        if whole or now_s - self._whole_s >= _WHOLE_S:
            self._show_all(state, now_s)
        else:
            self._link.show(lambda: dumped(_rounded(state)))

    def _show_all(self, state: dict[str, Any], now_s: float) -> None:
        """Show all of the present, and what has happened since."""
        run = self._run
        self._marks += self._known.note(run, self._system.tick_s)
        self._flush()
        state["requirements"] = [each.so_far(self._system.tick_s) for each in run.requirements]
        state["live"], state["panel"] = dict(run.live), dict(run.panel.values)
        if self._options.real_time:
            state["real_time"] = {
                name: {"late_ms": 1e3 * late_s, "skipped": skipped}
                for name, (late_s, skipped) in run.late().items()
            }
        if state["status"] != "ended":
            self._values = self._truth(run.time_s) if self._truth is not None else ()
        seen, truth = [(each, each.present) for each in self._seen.values()], self._values

        def text() -> bytes:
            self._whole_s = now_s
            return self._text(state, seen, truth)

        self._link.show(text)

    def rest(self) -> None:
        """The last tick is over; the plant is about to be closed."""
        self.sample("running")
        self._pictures.close()

    def end(self, data: Mapping[str, Any], exit_code: int) -> None:
        """The run is over; `data` is its report."""
        for fault in data.get("faults", ()):
            if fault["subsystem"] in self._seen:
                at = fault["stamp"], fault["time_s"], fault["message"]
                self._seen[fault["subsystem"]].fail(*at)
            self.mark("fault", fault["time_s"], f"{fault['culprit']}: {fault['message']}")
        self.sample("ended")
        report = {name: data.get(name, []) for name in ("faults", "requirements")}
        ending = {"kind": "end", "ended": data["ended"], "exit_code": exit_code, "report": report}
        self._link.post(lambda: dumped(ending), 0)

    # How it is done.

    def _refuse(self, text: str) -> None:
        self._link.post(dumped({"kind": "refused", "text": text}))

    def _poses_of(self, plant: Posed | None) -> Any:
        if plant is None or not self.wants_scene:
            return None
        try:
            return plant.body_poses()
        except Exception:  # noqa: BLE001  # whatever the user's class raises: it is only looked at
            self._posed = None
            return None

    def _measure(self, status: str, now_s: float, time_s: float) -> None:
        """Measure how fast the run goes on; a pause does not count."""
        if status == "paused":
            self._before = self._factor = None
        elif self._before is None:
            self._before = now_s, time_s
        elif now_s - self._before[0] >= _IDLE_S / 2:
            then_s, before_s = self._before
            self._factor = (time_s - before_s) / (now_s - then_s)
            self._before = now_s, time_s

    def _flush(self) -> None:
        if self._changes:
            changes, self._changes = self._changes, []
            self._link.post(lambda: dumped({"kind": "spans", "changes": changes}), len(changes))
        if self._marks:
            marks, self._marks = self._marks, []
            self._link.post(lambda: dumped({"kind": "marks", "marks": marks}), len(marks))

    def _text(
        self,
        state: dict[str, Any],
        seen: Sequence[tuple[LiveSubsystem, tuple[Any, ...]]],
        truth: Sequence[tuple[str, Callable[[], bytes]]],
    ) -> bytes:
        """The text of a sample."""
        steps = b",".join(
            dumped(each.steps.subsystem.name) + b":" + each.text(*present)
            for each, present in seen
            if present[1] is not None
        )
        plant = b",".join(dumped(name) + b":" + text() for name, text in truth)
        return b'%b,"steps":{%b},"plant":{%b}}' % (dumped(_rounded(state))[:-1], steps, plant)


def _rounded(state: dict[str, Any]) -> dict[str, Any]:
    """A state, with poses of few digits."""
    poses = state["poses"]
    return state if poses is None else {**state, "poses": poses.round(_DECIMALS)}


def _picture_text(picture: Picture) -> bytes:
    data = b64encode(picture.data).decode()
    about = {"kind": "picture", "camera": picture.camera, "time_s": picture.time_s}
    return dumped({**about, "jpeg": data})


def _truth_of(
    system: System, plant: Any, layouts: Mapping[str, Layout]
) -> Callable[[float], Sequence[tuple[str, Callable[[], bytes]]]] | None:
    """What gives the ground truth of the plant now: names, and what makes the texts of values."""
    if system.plant is None or plant is None or not system.plant.observed or PLANT not in layouts:
        return None
    cells, shelf = Cells(f"/{PLANT}/y", layouts[PLANT].y), NoImages()
    found = list[StepRecord]()
    onlooker = Onlooker(system.plant.observed, plant.sample, [found.append])

    def present(time_s: float) -> Sequence[tuple[str, Callable[[], bytes]]]:
        found.clear()
        onlooker.look(0, time_s)
        return [
            (".".join(cells.elements[name].name), partial(cells.cells[name].text, value, shelf))
            for name, value in found[0].sent
            if name in cells.cells
        ]

    return present


class _Known:
    """What the page knows of what has happened."""

    def __init__(self) -> None:
        self._violated: set[int] = set()
        self._cycles = 0
        self._ended_s = 0.0

    def note(self, run: Run, tick_s: float) -> list[dict[str, Any]]:
        """The marks of what has happened since."""
        found = []
        for number, each in enumerate(run.requirements):
            if number not in self._violated and each.verdict == "violated":
                self._violated.add(number)
                time_s = each.so_far(tick_s)["time_s"]
                found.append({"time_s": time_s, "kind": "violation", "text": each.that})
        for cycle in run.cycles()[self._cycles :]:
            self._ended_s += cycle["simulated_s"]
            text = f"cycle {self._cycles + 1}: {cycle['ended']}"
            found.append({"time_s": self._ended_s, "kind": "cycle", "text": text})
            self._cycles += 1
        return found
