"""A recording as a source of the page: nothing is run, and no file that it names is read.

Each moment is looked up in the file through the runtime's index of it.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from threading import Lock
from time import monotonic, sleep
from typing import Any, Protocol

from specc.reachable import grouped
from specc.refusal import Refused
from specc.tools.page.description import AssetShelf, Description
from specc.tools.page.messages import Asset, Message, Picture
from specc.tools.page.moments import flow_of, frames_of, series_of, states_of, values_of
from specc.tools.plot.sheet import Band, merge_short_spans
from specc.tools.why import Steps, violation_reasons
from specc.tools.why.lines import Explainer, seconds

SeenSteps = Mapping[str, Any]
"""The last step of each subsystem, each a `recording.moment.Seen` of the runtime."""

_MOST_SPANS = 3000
"""Of a machine that are shown one by one."""
_MOST_DECODED = 5000
"""Messages of a series; of more, every second one is left out, and so on."""
_LONGEST_WINDOW_S = 600.0
_AT_ONCE_S, _BETWEEN_S = 0.03, 0.001
"""Wall time for which a file is read while nobody can look at it, and for which others can."""
_EARLIER_S = 1e-6
_MOST_REASONS = 20
"""Requirements of which is said why they are violated."""
_LONGEST_MARK = 300
"""Characters of a mark; of a longer text that is its beginning."""
_NOWHERE = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
_NOTHING: Message = {"t": [], "lines": [], "words": []}


class RecordedContent(Protocol):
    """What is in the messages: as the specification says, or as it is there."""

    def message(self) -> Message:
        """What `hello` says of the specification."""

    def values(
        self, steps: SeenSteps, plant: Mapping[str, Any], names: Sequence[str] | None
    ) -> dict[str, str]:
        """The texts of these signals, or of all."""

    def frames(
        self, steps: SeenSteps, plant: Mapping[str, Any], names: Sequence[str] | None
    ) -> dict[str, Sequence[float]]:
        """The poses among these signals, see `moments.frames_of`."""

    def flow(self, steps: SeenSteps) -> list[str]:
        """The arcs on which something went."""

    def owner(self, name: str) -> str:
        """The subsystem of a signal, or `plant`; empty if there is no such signal."""

    def series(self, name: str, points: Iterable[tuple[float, Any]]) -> Message:
        """`t`, `lines` and `words`; the points are times and messages of the owner."""

    def violation(self, that: str, since_s: float, steps: Steps) -> list[str]:
        """Why a requirement fails at a time; nothing if that is not known."""

    def why(self, one: Any) -> list[Message]:
        """The lines of `why` for the last step of a subsystem."""


class SpecifiedContent:
    """What is in the messages, as a specification says."""

    def __init__(self, description: Description, explainer: Explainer) -> None:
        self._description, self._explainer = description, explainer

    def message(self) -> Message:
        """See `RecordedContent`."""
        return self._description.message

    def values(
        self, steps: SeenSteps, plant: Mapping[str, Any], names: Sequence[str] | None
    ) -> dict[str, str]:
        """See `RecordedContent`."""
        return values_of(self._description, steps, plant, names)

    def frames(
        self, steps: SeenSteps, plant: Mapping[str, Any], names: Sequence[str] | None
    ) -> dict[str, Sequence[float]]:
        """See `RecordedContent`."""
        return frames_of(self._description, steps, plant, names)

    def flow(self, steps: SeenSteps) -> list[str]:
        """See `RecordedContent`."""
        return flow_of(self._description, steps)

    def owner(self, name: str) -> str:
        """See `RecordedContent`."""
        if name in self._description.subsystems:
            return name
        signal = self._description.signals.get(name)
        return signal.owner if signal else ""

    def series(self, name: str, points: Iterable[tuple[float, Any]]) -> Message:
        """See `RecordedContent`."""
        return series_of(self._description, name, points)

    def violation(self, that: str, since_s: float, steps: Steps) -> list[str]:
        """See `RecordedContent`."""
        for each in self._description.system.run_requirements:
            if each.that == that:
                return [*violation_reasons(each, since_s, steps, seconds)]
        return []

    def why(self, one: Any) -> list[Message]:
        """See `RecordedContent`."""
        if one.name not in self._description.subsystems:
            return [line_of(f"the specification has no subsystem {one.name}")]
        lines = self._explainer.lines(one)
        return [line_of(*_fields(line)) for line in lines]


def _fields(line: Any) -> tuple[str, int, str, bool | None, str]:
    return line.text, line.depth, line.role, line.truth, line.place


def line_of(
    text: str, depth: int = 0, role: str = "reason", truth: bool | None = None, place: str = ""
) -> Message:
    """A line of `why`."""
    return {"text": text, "depth": depth, "role": role, "truth": truth, "place": place or None}


@dataclass(frozen=True, slots=True)
class Recording:
    """A file that is open: its `recording.index.Index`, and the metadata of the run.

    `call` calls a function of a module of the runtime, and raises Refused. `notices` tells what is
    to be said of the file. `spec` is the user's specification, empty if there is none.
    """

    index: Any
    about: Mapping[str, str]
    call: Callable[..., Any]
    notices: Callable[[], list[str]] = list
    spec: str = ""
    _lock: Lock = field(default_factory=Lock)
    """The index may be looked at while the file is being read."""

    def ask(self, question: str, *arguments: Any) -> Any:
        """What the file says of it; None where its messages are not those of a run."""
        try:
            with self._lock:
                return self.call("recording.queries", question, self.index, *arguments)
        except Refused:
            return None

    def steps(self, time_s: float, only: str = "") -> dict[str, Any]:
        """The last step of each subsystem until then, unless the next is lost. Raises Refused."""
        with self._lock:
            seen = self.call("recording.moment", "seen_at", self.index, time_s, only)
            return {one.name: one for one in seen if not self.index.lost_at(one.name, time_s)}

    def last_steps(self, time_s: float) -> Mapping[str, Mapping[str, Any]]:
        """The message of the last step of each subsystem until then; none if it has none."""
        with self._lock:
            found: Mapping[str, Mapping[str, Any]] = self.call(
                "recording.moment", "last_steps", self.index, time_s
            )
        return found

    def spans(self) -> dict[str, list[tuple[float, float, str]]]:
        """The spans of all machines, each with begin and end in s and the state."""
        index, texts = self.index, self.index.names.texts
        with self._lock:
            return {
                name: [(begin_s, end_s, texts[n]) for begin_s, end_s, n in index.spans(own)]
                for name, own in index.machines.items()
            }

    def read_on(self, for_s: float) -> None:
        """Read on for so long of wall time, or to the end. Raises Refused."""
        end_s = monotonic() + for_s
        while not self.index.is_whole and monotonic() < end_s:
            with self._lock:
                self.call("recording.index", "read_on", self.index, _AT_ONCE_S)
            sleep(_BETWEEN_S)


class RecordedRun:
    """A recording, as a source of the page."""

    def __init__(self, recording: Recording, content: RecordedContent, assets: AssetShelf) -> None:
        self._recording, self._content, self._assets = recording, content, assets
        self._scene: str | None = None
        self._reasons: dict[str, list[str]] = {}
        """Why requirements are violated, by their texts."""
        self.refresh()

    def refresh(self) -> None:
        """Look at what is read of the file by now."""
        recording, index = self._recording, self._recording.index
        self._begin_s, self._end_s = min(index.begin_s, index.end_s), float(index.end_s)
        self._about = self._content.message()
        required = [each["that"] for each in self._about["requirements"]]
        self._marks = list(recording.ask("marks", required) or ())
        if index.is_whole:
            self._reasons = dict(self._reasons_of(required))
        self._cameras = dict(recording.ask("pictured"))
        poses = (recording.ask("poses_at", t) for t in (self._begin_s, self._end_s))
        self._bodies = list(next(filter(None, poses), ()))
        if self._scene is None and recording.ask("shapes_of"):
            self._scene = self._assets.add(self._shapes)
        length_s, self._spans = self._end_s - self._begin_s or 1.0, recording.spans()
        for name, spans in self._spans.items():
            if len(spans) > _MOST_SPANS:
                band = Band(name, tuple(spans), ())
                self._spans[name] = list(merge_short_spans(band, length_s))
        self._last = {**self.moment(None, []), "status": "ended", "speed": None, "factor": None}

    def _reasons_of(self, required: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
        """Why requirements are violated that have marks, of the first ones."""
        since_s = {m["text"]: m["time_s"] for m in self._marks if m["kind"] == "violation"}
        found = [that for that in required if that[:_LONGEST_MARK] in since_s]
        for that in found[:_MOST_REASONS]:
            at_s = since_s[that[:_LONGEST_MARK]]
            yield that, self._content.violation(that, at_s, self._recording.last_steps)

    @property
    def most_messages(self) -> int:
        """Of a chunk of the file: what it takes to look up a moment."""
        return int(self._recording.index.most_messages)

    @property
    def is_whole(self) -> bool:
        """Whether all of the file is read."""
        return bool(self._recording.index.is_whole)

    def read_on(self, for_s: float) -> None:
        """Read on for so long of wall time, or to the end. Raises Refused."""
        self._recording.read_on(for_s)
        self.refresh()

    # All of the run.

    def hello(self) -> Message:
        """See `Source`."""
        recording = self._recording
        paced = recording.call("recording.messages", "followed_the_clock", recording.about)
        never = dict.fromkeys(("pause", "step", "speed", "break", "live", "panel", "set"), False)
        return {
            **self._about,
            "source": "file",
            "file": recording.index.path.name,
            "seed": recording.about.get("seed"),
            "real_time": bool(paced),
            "begin_s": self._begin_s,
            "end_s": self._end_s,
            "duration_s": None,
            "notice": recording.notices(),
            "cameras": list(self._cameras),
            "bodies": self._bodies,
            "scene": self._scene,
            "live": [],
            "panel": [],
            "requirements": [
                {**each, "reasons": self._reasons.get(each["that"], [])}
                for each in self._about["requirements"]
            ],
            "can": {**never, "restart": bool(recording.spec)},
        }

    def spans(self) -> Message:
        """See `Source`."""
        return self._spans

    def marks(self) -> list[Message]:
        """See `Source`."""
        return self._marks

    # A moment.

    def now(self) -> Message:
        """See `Source`."""
        return self._last

    def moment(
        self, time_s: float | None, signals: list[str] | None, *, has_scene: bool = True
    ) -> Message:
        """See `Source`; without the scene there are no poses and nothing on arcs."""
        at_s = self._inside(time_s)
        try:
            steps = self._recording.steps(at_s)
            states = states_of(steps)
        except Refused:  # a message of a stranger; changes are known all the same
            steps, states = {}, self._states_at(at_s)
        plant = self._recording.ask("observed_at", at_s) or {}
        return {
            "time_s": at_s,
            "states": states,
            "values": self._content.values(steps, plant, signals),
            "frames": self._content.frames(steps, plant, signals) if has_scene else {},
            "requirements": self._recording.ask("requirements_at", at_s) or [],
            "poses": self._poses_at(at_s) if has_scene else None,
            "flow": self._content.flow(steps) if has_scene else [],
        }

    def _inside(self, time_s: float | None) -> float:
        return self._end_s if time_s is None else max(self._begin_s, min(time_s, self._end_s))

    def _states_at(self, time_s: float) -> dict[str, Message]:
        """The states of machines, without what messages say."""
        found: dict[str, Message] = {}
        for name, spans in self._spans.items():
            before = [span for span in spans if span[0] <= time_s + _EARLIER_S]
            if before and not self._recording.index.lost_at(name, time_s):
                found[name] = {"state": before[-1][2], "since_s": before[-1][0], "row": ""}
        return found

    def why(self, machine: str, time_s: float | None) -> Message:
        """See `Source`."""
        at_s = self._inside(time_s)
        try:
            one = self._recording.steps(at_s, machine).get(machine)
            lines = self._content.why(one) if one is not None else self._lost(machine, at_s)
        except Refused as refused:
            lines = [line_of(str(refused))]
        return {"machine": machine, "time_s": at_s, "lines": lines}

    def _lost(self, machine: str, time_s: float) -> list[Message]:
        """What to say of a machine without a step at a time."""
        index = self._recording.index
        lost = index.lost_at(machine, time_s) if machine in index.machines else None
        if lost is None:
            return []
        before_s, after_s = lost
        after = "" if after_s is None else f" and before {after_s:.6g} s"
        return [line_of(f"steps of {machine} after {before_s:.6g} s{after} are lost", 0, "state")]

    def series(self, name: str, time_s: float | None, window_s: float) -> Message:
        """See `Source`."""
        return self.several_series([name], time_s, window_s)[name]

    def several_series(
        self, names: Sequence[str], time_s: float | None, window_s: float
    ) -> dict[str, Message]:
        """`series` of several signals: the messages of each owner are read once."""
        window_s = min(window_s, _LONGEST_WINDOW_S)
        end_s = self._end_s if time_s is None else time_s + window_s / 2
        begin_s, found = end_s - window_s, dict[str, Message]()
        for owner, own in grouped((self._content.owner(name), name) for name in names).items():
            points = self._recording.ask("window", owner, begin_s, end_s, _MOST_DECODED)
            for name in own:
                lines = self._content.series(name, points) if points else _NOTHING
                found[name] = {"name": name, "begin_s": begin_s, "end_s": end_s, **lines}
        return found

    # Scene and pictures.

    def _poses_at(self, time_s: float) -> list[list[float]] | None:
        poses = self._recording.ask("poses_at", time_s)
        return [poses.get(name, _NOWHERE) for name in self._bodies] if poses else None

    def _shapes(self) -> Asset | None:
        """The bodies of the scene, as they are in the file."""
        text = self._recording.ask("shapes_of")
        return Asset("application/json", text) if text else None

    def asset(self, number: int) -> Asset | None:
        """See `Source`."""
        return self._assets.get(number)

    def picture(self, camera: str, time_s: float | None) -> Picture | None:
        """See `Source`."""
        if (topic := self._cameras.get(camera)) is None:
            return None
        found = self._recording.ask("picture_at", topic, self._inside(time_s))
        return Picture(camera, *found) if found else None

    def objection(self, values: Mapping[str, str]) -> str:
        """See `Source`."""
        return ""

    def command(self, message: Message) -> str:
        """See `Source`."""
        spec = self._recording.spec
        if message["type"] == "watch":
            return ""
        if message["type"] != "restart":
            return "a recording cannot do that; nothing runs"
        if not spec:
            return "name your specification to start again: specc view FILE.mcap --spec SPEC"
        at = f"{self._recording.index.path}@{self._inside(message.get('from_s')):.12g}"
        values = [f"--set={name}={text}" for name, text in (message.get("set") or {}).items()]
        if scenario := self._recording.about.get("scenario"):
            values.append(f"--scenario={scenario}")
        words = shlex.join(["specc", "run", spec, "--from", at, "--ui", *values])
        return f"start it in a terminal: {words}"
