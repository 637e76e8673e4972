"""The page of a run, in a process of its own: `python -m specc.tools.page.live FD SPEC --port N`.

The run sends lines of JSON through a socket and gets commands back. What it sent is kept, the
states of the last part of it and all changes, so that a browser can look back. This process ends
when the run closes its end.
"""

from __future__ import annotations

import argparse
import asyncio
import base64
import binascii
import math
import signal
import socket
import sys
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from threading import Lock
from typing import Any, NamedTuple

from specc import pipeline
from specc.diagnostics import blocks
from specc.diagnostics.report import brief, resolve
from specc.diagnostics.visible import visible
from specc.lang.values import Floats
from specc.model.bindings import PLANT
from specc.refusal import Refused
from specc.source import SET, Sources
from specc.tools.page.description import AssetShelf, Description
from specc.tools.page.messages import Asset, Message, Picture, json_text
from specc.tools.page.moments import (
    NO_LINES,
    DrawnSignal,
    LastStep,
    drawn_signal,
    flow_of,
    frames_of,
    lines_of,
    part_of,
    states_of,
    unsent_of,
    values_of,
    why_of,
)
from specc.tools.page.server import Server
from specc.tools.why import Explainer

_MOST_BYTES = 64_000_000
"""Of texts of states that are kept."""
_LONGEST_LINE = 1 << 26
_MOST_SPANS, _MOST_MARKS = 100_000, 5_000
"""Of all machines, and of a run, that are kept: a browser that comes late gets all of them."""
_MOST_OF_MACHINE = 20_000
_MOST_FOLLOWED = 16
"""Signals whose numbers are kept."""
_NEWS = "time_s", "wall_s", "status", "speed", "factor", "poses"
"""What each state says; the others come less often."""
_RECENT = 5
_MOST_REASONS = 3
"""Why a run cannot be started again, that a message has."""
_ROUNDING_S = 1e-9
_DO = {"break", "continue", "hold", "panel", "pause", "release", "restart", "set", "speed", "step",
       "watch"}  # fmt: skip
"""Commands that a run gets as the browser sends them."""


class RunHistory:
    """The states that a run sent, by time; of too many bytes the earliest go."""

    def __init__(self, most_bytes: int = _MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._times: list[float] = []
        self._texts: list[bytes] = []
        self._bytes = 0
        self._lock = Lock()

    def keep(self, time_s: float, text: bytes) -> None:
        """Keep a state; one of the same time replaces the last."""
        with self._lock:
            while self._times and self._times[-1] >= time_s:
                self._times.pop()
                self._bytes -= len(self._texts.pop())
            self._times.append(time_s)
            self._texts.append(text)
            self._bytes += len(text)
            if self._bytes > self._most_bytes:
                dropped = max(1, len(self._texts) // 8)
                self._bytes -= sum(map(len, self._texts[:dropped]))
                del self._times[:dropped], self._texts[:dropped]

    def at(self, time_s: float) -> bytes | None:
        """The last state until then."""
        with self._lock:
            place = bisect_right(self._times, time_s + _ROUNDING_S)
            return self._texts[place - 1] if place else None

    def after(self, time_s: float) -> bytes | None:
        """The first state after that."""
        with self._lock:
            place = bisect_right(self._times, time_s + _ROUNDING_S)
            return self._texts[place] if place < len(self._texts) else None

    def between(self, begin_s: float, end_s: float) -> list[bytes]:
        """The states of a stretch of time, with the one before it."""
        with self._lock:
            first = max(0, bisect_right(self._times, begin_s) - 1)
            return self._texts[first : bisect_right(self._times, end_s)]


class FollowedSignal:
    """The numbers of a signal in the last part of a run, in which each state is read once."""

    def __init__(self, drawn: DrawnSignal) -> None:
        self.drawn = drawn
        self._begin_s = math.inf
        self._times: list[float] = []
        self._rows: list[Floats] = []

    def lines(self, history: RunHistory, begin_s: float, end_s: float) -> Message:
        """`t`, `lines` and `words` from a time on; `end_s` is the present."""
        times, rows = self._times, self._rows
        if begin_s < self._begin_s:
            times.clear()
            rows.clear()
        self._begin_s, since_s = begin_s, begin_s
        if times:  # the last state was perhaps replaced by one of the same time
            since_s = times.pop()
            rows.pop()
        for text in history.between(since_s, end_s):
            state = _loaded(text)
            times.append(state["time_s"])
            rows.append(self.drawn.read(_message(state, self.drawn.owner)))
        gone = max(0, bisect_right(times, begin_s) - 1)
        del times[:gone], rows[:gone]
        return lines_of(self.drawn, times, rows)


class StateChange(NamedTuple):
    """A change of the state of a machine, by a row."""

    time_s: float
    state: str
    row: str


class RowRepeats(NamedTuple):
    """A row that a machine took, so many times one after the other, from a time to another."""

    begin_s: float
    end_s: float
    times: int
    row: str

    def until(self, time_s: float) -> RowRepeats:
        """What of it was until a time, as if it were taken evenly."""
        if self.end_s <= time_s:
            return self
        period_s = (self.end_s - self.begin_s) / (self.times - 1)
        periods = int((time_s - self.begin_s) / period_s + 1e-6)
        end_s = self.begin_s + periods * period_s
        return self._replace(end_s=end_s, times=periods + 1)


class LiveRun:
    """What a run sent, as a source of the page."""

    def __init__(
        self,
        spec: str,
        values: Mapping[str, str],
        send: Callable[[bytes], None],
        scenario: str | None = None,
    ) -> None:
        """`send` sends a command to the run. Raises Refused."""
        self._spec, self._scenario = spec, scenario
        self._send = send
        self.begin: Message = {}
        self.compile(values)
        self._forget()

    def compile(self, values: Mapping[str, str], is_exact: bool = False) -> None:
        """Read the specification. Raises Refused."""
        result = pipeline.compile_spec(self._spec, values, scenario=self._scenario)
        if result.system is None:
            raise Refused(f"{self._spec} has errors; `specc validate` lists them")
        self._values = dict(values)
        self._assets = AssetShelf()
        self._description = Description(result.system, result, self._assets)
        self._explainer = Explainer(
            self._spec,
            result.system,
            result.sources,
            is_exact=is_exact,
            array=lambda value: import_module("specc_runtime.stepping").array(value),
        )
        self._scene = ""

    def _forget(self) -> None:
        """Begin with nothing."""
        self._history = RunHistory()
        self._state: Message = {}
        self._end: Message | None = None
        self._news: Message = {}
        """What the run sent of the present since then."""
        self._followed: dict[str, FollowedSignal] = {}
        self._spans: dict[str, list[StateChange]] = defaultdict(list)
        self._rows: dict[str, list[RowRepeats]] = defaultdict(list)
        self._marks: list[Message] = []
        self._pictures: dict[str, Picture] = {}

    # What the run sends.

    async def follow(self, reader: asyncio.StreamReader, server: Server) -> None:
        """Take what the run sends, until it closes its end."""
        while True:
            try:
                line = await reader.readline()
            except ValueError:  # longer than any message of a run
                continue
            if not line:
                return
            try:
                await self._take(_loaded(line), line, server)
            except (Refused, ValueError, TypeError, LookupError, AttributeError) as error:
                text = f"a message of the run was not understood: {type(error).__name__}: {error}"
                server.tell({"type": "refused", "text": visible(text[:300])})

    async def _take(self, message: Any, line: bytes, server: Server) -> None:
        """Note a message of the run, and tell browsers of it."""
        match message:
            case {"kind": "state", "time_s": int() | float() as time_s, "steps": dict()}:
                steps_of_state(message)
                self._history.keep(float(time_s), line)
                self._state, self._news = message, {}
                server.tell_now()
            case {"kind": "state", "time_s": int() | float()} if "steps" not in message:
                self._news = {name: message.get(name) for name in _NEWS}
                server.tell_news(self._news)
            case {"kind": "spans", "changes": list() as changes}:
                if spans := self._add(changes):
                    server.tell({"type": "spans", "spans": spans, "replace": False})
            case {"kind": "marks", "marks": list() as marks}:
                self._mark([_mark(mark) for mark in marks], server)
            case {"kind": "begin"}:
                await self._begin(message)
                server.begin()
            case {"kind": "picture", "camera": str() as camera, "jpeg": str() as jpeg}:
                data = base64.b64decode(jpeg, validate=True)
                picture = Picture(camera, float(message["time_s"]), data)
                self._pictures[camera] = picture
                server.tell_picture(picture)
            case {"kind": "lost"}:
                text = "the page could not keep up: some of what happened is missing"
                self._mark([{"time_s": self._time_s, "kind": "lost", "text": text}], server)
            case {"kind": "stopped" | "end" | "refused" | "starting" as kind}:
                found = {name: value for name, value in message.items() if name != "kind"}
                self._end = found if kind == "end" else self._end
                server.tell({"type": kind, **found})
            case _:
                raise Refused("it is of no known kind")

    async def _begin(self, message: Message) -> None:
        """Begin anew; the run may have other constants, and the specification other texts."""
        values = {str(name): str(text) for name, text in message.get("set", {}).items()}
        is_exact = message.get("exact") is True
        if self.begin or is_exact or values != self._values:
            await asyncio.to_thread(self.compile, values, is_exact)
        self._forget()
        self.begin = message
        if message.get("scene") is not None:
            content = json_text(message["scene"]).encode()
            self._scene = self._assets.add(lambda: Asset("application/json", content))

    def _add(self, changes: list[Any]) -> dict[str, list[Any]]:
        """Note changes of states; what is new of the spans."""
        new: dict[str, list[Any]] = defaultdict(list)
        most = min(_MOST_OF_MACHINE, _MOST_SPANS // max(1, len(self._description.subsystems)))
        for name, time_s, state, row in changes:
            spans = self._spans[str(name)]
            if not spans or spans[-1].state != state:
                spans.append(StateChange(float(time_s), str(state), str(row)))
                new[str(name)].append([float(time_s), None, str(state)])
            rows = self._rows[str(name)]
            if row and rows and rows[-1].row == row:
                rows[-1] = rows[-1]._replace(end_s=float(time_s), times=rows[-1].times + 1)
            elif row:
                rows.append(RowRepeats(float(time_s), float(time_s), 1, str(row)))
            for each in (spans, rows):
                if len(each) > most:
                    del each[: len(each) - most + most // 8]
        return new

    def _mark(self, marks: list[Message], server: Server) -> None:
        self._marks = (self._marks + marks)[-_MOST_MARKS:]
        server.tell({"type": "marks", "marks": marks, "replace": False})

    @property
    def _time_s(self) -> float:
        return float(self._state.get("time_s", self.begin.get("begin_s") or 0.0))

    # What the page asks.

    def hello(self) -> Message | None:
        """See `Source`."""
        begin = self.begin
        if not begin:
            return None
        can = begin.get("can") or {}
        can_pause, can_restart = bool(can.get("pause")), bool(can.get("restart"))
        panel, live = (self._described(begin.get(name) or []) for name in ("panel", "live"))
        return {
            **self._description.message,
            "source": "live",
            "seed": begin.get("seed"),
            "real_time": bool(begin.get("real_time")),
            "begin_s": begin.get("begin_s") or 0.0,
            "repeats_until_s": begin.get("repeats_until_s") or 0.0,
            "end_s": None,
            "end": self._end,
            "duration_s": begin.get("duration_s"),
            "notice": [],
            "cameras": begin.get("cameras") or [],
            "bodies": begin.get("bodies") or [],
            "scene": self._scene or None,
            "live": live,
            "panel": panel,
            "set": begin.get("set") or {},
            "can": {
                **dict.fromkeys(("pause", "step", "speed", "break"), can_pause),
                **dict.fromkeys(("restart", "set"), can_restart),
                "live": bool(live),
                "panel": bool(panel),
            },
        }

    def _described(self, parts: list[Any]) -> list[Message]:
        """Constants or elements of the panel, with titles and units of the specification."""
        known = self._description.words
        return [{**known.get(str(each["name"]), {}), **each} for each in parts]

    def spans(self) -> Message:
        """See `Source`."""
        found = {}
        for name, begins in self._spans.items():
            ends = [each.time_s for each in begins[1:]]
            pairs = zip(begins, [*ends, None], strict=True)
            found[name] = [[each.time_s, end_s, each.state] for each, end_s in pairs]
        return found

    def marks(self) -> list[Message]:
        """See `Source`."""
        return self._marks

    def now(self) -> Message:
        """See `Source`."""
        state = self._state
        steps = steps_of_state(state)
        names = ("live", "panel", "real_time")
        return {
            "time_s": self._time_s,
            "status": state.get("status", "running"),
            "speed": state.get("speed"),
            "factor": state.get("factor"),
            "wall_s": state.get("wall_s"),
            "poses": state.get("poses"),
            "states": states_of(steps),
            "flow": flow_of(self._description, steps),
            "requirements": state.get("requirements") or [],
            **{name: state[name] for name in names if state.get(name) is not None},
            **self._news,
        }

    def moment(self, time_s: float | None, signals: list[str] | None) -> Message:
        """See `Source`."""
        state = self._at(time_s)
        steps = steps_of_state(state)
        return {
            "time_s": self._time_s if time_s is None else time_s,
            "states": states_of(steps) if time_s is None else self._states_at(time_s, steps),
            "values": values_of(self._description, steps, state.get("plant"), signals),
            "frames": frames_of(self._description, steps, state.get("plant"), signals),
            "requirements": state.get("requirements") or [],
            "poses": state.get("poses"),
            "flow": flow_of(self._description, steps),
        }

    def _at(self, time_s: float | None) -> Message:
        """The state at a time; empty if it is not kept."""
        if time_s is None:
            return self._state
        text = self._history.at(time_s)
        return _loaded(text) if text is not None else {}

    def _states_at(self, time_s: float, steps: Mapping[str, LastStep]) -> dict[str, Message]:
        """The states of machines at a time: they may have changed since the last state was sent."""
        found = states_of(steps)
        for name in list(self._spans):
            for last in self._changes(name, time_s)[-1:]:
                if name not in steps or last.time_s > steps[name].step["time"]:
                    found[name] = {"state": last.state, "since_s": last.time_s, "row": last.row}
        return found

    def _changes(self, machine: str, time_s: float) -> list[StateChange]:
        """The changes of a machine until a time."""
        begins = self._spans.get(machine, [])
        return begins[: bisect_right(begins, time_s + _ROUNDING_S, key=lambda each: each.time_s)]

    def why(self, machine: str, time_s: float | None) -> Message:
        """See `Source`."""
        one, unsent = self._step(machine, time_s)
        if unsent is not None:
            return {"machine": machine, "time_s": time_s, "lines": unsent_of(machine, *unsent)}
        if one is not None:
            until_s, rows = one.step["time"] + _ROUNDING_S, self._rows.get(machine, [])
            place = bisect_right(rows, until_s, key=lambda each: each.begin_s)
            recent = [each.until(until_s) for each in rows[max(0, place - _RECENT) : place]]
            one = replace(one, recent=recent)
        at_s = self._time_s if time_s is None else time_s
        known = one if machine in self._description.subsystems else None
        return {"machine": machine, "time_s": at_s, "lines": why_of(self._explainer, known)}

    def _step(
        self, machine: str, time_s: float | None
    ) -> tuple[LastStep | None, StateChange | None]:
        """The last step until a time that is kept; the next one if only that has its state.

        If none has it, also the change to that state.
        """
        one = steps_of_state(self._at(time_s)).get(machine)
        for last in self._changes(machine, time_s)[-1:] if time_s is not None else ():
            if one is None or one.step["time"] < last.time_s:
                text = self._history.after(time_s or 0.0)
                later = steps_of_state(_loaded(text)).get(machine) if text is not None else None
                has_state = later is not None and later.step["state"] == last.state
                return (later, None) if has_state else (one, last)
        return one, None

    def series(self, name: str, time_s: float | None, window_s: float) -> Message:
        """See `Source`."""
        end_s = self._time_s if time_s is None else time_s + window_s / 2
        begin_s = end_s - window_s
        followed = self._followed.pop(name, None) if time_s is None else None
        if followed is None and (drawn := drawn_signal(self._description, name)):
            followed = FollowedSignal(drawn)
        found = followed.lines(self._history, begin_s, end_s) if followed else NO_LINES
        if followed and time_s is None:
            self._followed[name] = followed
            if len(self._followed) > _MOST_FOLLOWED:
                del self._followed[next(iter(self._followed))]
        return {"name": name, "begin_s": begin_s, "end_s": end_s, **found}

    def asset(self, number: int) -> Asset | None:
        """See `Source`."""
        return self._assets.get(number)

    def picture(self, camera: str, time_s: float | None) -> Picture | None:
        """See `Source`."""
        return self._pictures.get(camera) if time_s is None else None

    def objection(self, values: Mapping[str, str]) -> str:
        """See `Source`."""
        constants = self.begin.get("set", {}) | values
        result = pipeline.compile_spec(self._spec, constants)
        if result.can("run"):
            return ""
        reasons = [each for each in result.diagnostics if blocks(each.code, "run")]
        reasons.sort(key=lambda each: each.primary.file != SET)
        words = map(brief, resolve(reasons[:_MOST_REASONS], Sources(result.sources)))
        return f"The run is not started again. {'; '.join(words)}"

    def command(self, message: Message) -> str:
        """See `Source`."""
        if message["type"] not in _DO:
            return "a run cannot do that"
        command = {name: value for name, value in message.items() if name != "type"}
        self._send(json_text({"do": message["type"], **command}).encode() + b"\n")
        return ""


def _loaded(text: bytes) -> Any:
    """The data of a line. Raises Refused."""
    try:
        return import_module("specc_runtime.recording.text").loaded(text)
    except Exception as error:
        if type(error).__name__ != "Misshapen":
            raise
        raise Refused(str(error)) from error


def _message(state: Message, owner: str) -> Any:
    """The message of a state in which the signals of a subsystem are, or of the plant."""
    return {"y": state.get("plant")} if owner == PLANT else part_of(state, ("steps", owner, "step"))


def steps_of_state(state: Message) -> dict[str, LastStep]:
    """The last steps of a state that the run sent. Raises what data of another shape raises."""
    return {
        name: LastStep(
            name,
            dict(one["step"]),
            one.get("memory"),
            one.get("entered_s"),
            one.get("since_s"),
            str(one.get("row") or ""),
        )
        for name, one in state.get("steps", {}).items()
    }


def _mark(mark: Mapping[str, Any]) -> Message:
    text = str(mark["text"])[:1000]
    return {"time_s": float(mark["time_s"]), "kind": str(mark["kind"]), "text": text}


# The process.


async def _serve(options: argparse.Namespace) -> None:
    end = socket.socket(fileno=options.descriptor)
    reader, writer = await asyncio.open_connection(sock=end, limit=_LONGEST_LINE)
    run = LiveRun(options.spec, dict(options.set), writer.write, options.scenario)
    server = Server(run, options.port)
    try:
        await server.start()
    except OSError as error:
        raise Refused(f"no page at port {options.port}: {error.strerror}") from error
    print(f"specc: {server.url}", file=sys.stderr, flush=True)
    try:
        await run.follow(reader, server)
    except (ConnectionError, binascii.Error):
        pass
    finally:
        await server.stop()


def _assignment(text: str) -> tuple[str, str]:
    name, _, value = text.partition("=")
    return name, value


def main() -> int:
    """Serve the page until the run closes its end; the exit code."""
    parser = argparse.ArgumentParser(prog="specc.tools.page.live")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("spec")
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--set", type=_assignment, action="append", default=[])
    parser.add_argument("--scenario")
    options = parser.parse_args()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run decides when the page ends
    try:
        asyncio.run(_serve(options))
    except Refused as refused:
        print(f"specc: {visible(str(refused))}", file=sys.stderr, flush=True)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
