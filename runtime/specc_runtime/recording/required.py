"""Requirements on a recorded run: the monitors of runs follow the recorded steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from math import isfinite
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeGuard

from specc_runtime.buffers import slots
from specc_runtime.forms import Element, Layout, NotRecorded
from specc_runtime.recording.messages import (
    LATEST_S,
    NOTHING,
    Shelved,
    first_of,
    simulated_s,
    step_of,
    within,
)
from specc_runtime.recording.steps import topic_of
from specc_runtime.recording.text import loaded
from specc_runtime.records import StepRecord
from specc_runtime.requirements import Reading, Requirements
from specc_runtime.sampling import PLANT
from specc_runtime.snapshot import PART, Values
from specc_runtime.system import System

_ROUNDING_S = 1e-6  # times are multiples of a rounded tick


class Watch:
    """Judges the requirements of a system on a recorded run.

    Values that the file lacks are unknown. Arrays may have single precision only.
    """

    def __init__(self, system: System, layouts: Mapping[str, Layout], shelf: Shelved) -> None:
        """The system has requirements and has made no step."""
        assert system.requirements is not None
        self._requirements: Requirements = system.requirements
        self._tick_s = system.tick_s
        self._shelf = shelf
        read: dict[str, list[Reading]] = {}
        for reading in self._requirements.readings:
            read.setdefault(reading.subsystem, []).append(reading)
        owners = {s.subsystem.name: (_copy(s.subsystem.x), s.ticks) for s in system.subsystems}
        owners[PLANT] = SimpleNamespace(), 1
        self._sources = {
            topic_of(name): _Source(name, ticks, x, _elements(read.get(name, ()), layouts), shelf)
            for name, (x, ticks) in owners.items()
        }
        followed = {source.name: (source, source.ticks) for source in self._sources.values()}
        self._requirements.follow(followed, system.tick_s)

    def begin(self, saved: Mapping[str, Any], values: Values) -> None:
        """Go on from a snapshot; raises one of WRONG for data that is no snapshot."""
        known, tick = saved.get("requirements", ()), int(saved["tick"])
        self._requirements.restore(known, tick, partial(values.found, "requirements"))
        stamps = {**saved["stamps"], PLANT: saved["tick"] - 1}
        for source in self._sources.values():
            source.begin(
                int(stamps.get(source.name, -1)) + 1, self._tick_s
            )  # a new one has no steps

    def take(self, topic: str, text: bytes) -> None:
        """Note a message; raises Misshapen."""
        source = self._sources.get(topic)
        if source is not None and not source.is_over:
            self._note(source, source.follow(text, self._tick_s))

    def _note(self, source: _Source, record: StepRecord | None) -> None:
        if record is not None:
            self._requirements(record)
            self._requirements.advance(round(record.time_s / self._tick_s))

    def finish(self, until_s: float) -> None:
        """End the run, at the end of the recording."""
        for source in self._sources.values():
            self._note(source, source.end())
        ends = [(source.begun_s, source.settled_s) for source in self._sources.values()]
        begun, last = (round(max(s) / self._tick_s) for s in zip(*ends, strict=True))
        total_s = simulated_s(self._shelf.report)
        end = begun + 1 if total_s is None else round(total_s / self._tick_s)
        if isfinite(until_s):
            end = min(end, int(until_s / self._tick_s + 1e-6) + 1)
        self._requirements.finish(min(end, last))

    @property
    def violated(self) -> bool:
        """Whether a requirement is violated."""
        return self._requirements.violated

    def as_data(self) -> list[dict[str, Any]]:
        """The entries of the report of a run; `missing` names the values that the file lacks."""
        found = self._requirements.as_data()
        known = {item for source in self._sources.values() for item in source.known}
        absent = {r.attribute for r in self._requirements.readings} - known
        for data, requirement in zip(found, self._requirements.requirements, strict=True):
            data["missing"] = [
                n for n, attribute in requirement.reads.items() if attribute in absent
            ]
        return found


def _is_time(told_s: Any) -> TypeGuard[float]:
    return isinstance(told_s, int | float) and 0 <= told_s < LATEST_S


class _Step(NamedTuple):
    """A recorded step: its period, when it began and was seen, its state and what is read of it."""

    stamp: int
    time_s: float
    visible_s: float
    state: str
    found: Sequence[tuple[Reading, str, Any]]


def _copy(buffer: Any) -> SimpleNamespace:
    there = (name for name in slots(buffer) if hasattr(buffer, name))
    return SimpleNamespace(**{name: getattr(buffer, name) for name in there})


def _elements(
    readings: Sequence[Reading], layouts: Mapping[str, Layout]
) -> Iterator[tuple[Reading, str, Element | None]]:
    """Each reading with its part of a message and its element there; a state has none."""
    for reading in readings:
        part, layout = PART.get(reading.kind, ""), layouts.get(reading.subsystem)
        members = getattr(layout, part) if part and layout else ()
        found = (element for element in members if element.attribute == reading.element)
        yield reading, part, next(found, None)


class _Source:
    """A recorded subsystem, or the plant: its `x` and `memory` after its last step."""

    def __init__(
        self,
        name: str,
        ticks: int,
        x: SimpleNamespace,
        readings: Iterator[tuple[Reading, str, Element | None]],
        shelf: Shelved,
    ) -> None:
        """`x` has the values before the first step."""
        self.name, self.ticks, self.x = name, ticks, x
        self.memory = SimpleNamespace()
        self.known: set[str] = set()
        self.is_over = False
        self._readings = tuple(readings)
        self._shelf = shelf
        self.begun_s, self.settled_s = 0.0, 0.0
        """When its last step began, and until when its values are known."""
        self._stamp = 0
        self._pending: _Step | None = None
        """The last step, whose values hold until the next step."""
        self._last: dict[Element, tuple[Any, Any]] = {}

    def begin(self, stamp: int, tick_s: float) -> None:
        """The next step has this stamp."""
        self._stamp = stamp
        self.begun_s = max(0, stamp - 1) * self.ticks * tick_s
        self.settled_s = stamp * self.ticks * tick_s

    def follow(self, text: bytes, tick_s: float) -> StepRecord | None:
        """Note a step; returns the record of the step before, which ends here.

        None before the first step, and from the first incomplete step on.
        """
        message = loaded(text) if self.name == PLANT else step_of(text)
        pending, self._pending = self._pending, None
        if not isinstance(message, dict) or not {"y", "stamp"} <= message.keys():
            self.is_over = True  # the step failed
        elif first_of(message) != self._stamp:
            self.is_over = True  # steps before it are missing
        elif (times := self._times(message, tick_s)) is None:
            self.is_over, pending = True, None  # it had another rate
        else:
            self._stamp = message["stamp"] + 1
            found = [
                (reading, part, self._value(message.get(part), element) if element else NOTHING)
                for reading, part, element in self._readings
            ]
            self._pending = _Step(message["stamp"], *times, message.get("state", ""), found)
        return pending and self._record(pending)

    def _times(self, message: Mapping[str, Any], tick_s: float) -> tuple[float, float] | None:
        """When a step began and was seen; None if it is not a step of this rate."""
        stamp, begun_s, period_s = message["stamp"], message.get("time"), self.ticks * tick_s
        if "visible" in message and _is_time(begun_s) and _is_time(message["visible"]):
            return float(begun_s), float(message["visible"])
        is_regular = _is_time(begun_s) and abs(begun_s - stamp * period_s) < _ROUNDING_S
        return (stamp * period_s, (stamp + 1) * period_s) if is_regular else None

    def end(self) -> StepRecord | None:
        """The record of the last step."""
        pending, self._pending = self._pending, None
        return pending and self._record(pending)

    def _record(self, step: _Step) -> StepRecord:
        sent = {}
        for reading, part, value in step.found:
            if value is not NOTHING:
                if part == "y":
                    sent[reading.element] = value
                else:
                    setattr(getattr(self, part), reading.element, value)
            if value is not NOTHING or reading.kind == "state":
                self.known.add(reading.attribute)
        self.begun_s, self.settled_s = step.time_s, step.visible_s
        fields = self.name, step.stamp, step.time_s, step.state, -1, tuple(sent.items()), ()
        return StepRecord(*fields, step.visible_s)

    def _value(self, data: Any, element: Element) -> Any:
        found = within(data, element)
        last = self._last.get(element)
        if found is NOTHING or (last is not None and last[0] == found):
            return last[1] if last is not None and found is not NOTHING else NOTHING
        try:
            value = element.form.value(found, self._shelf)
        except NotRecorded:
            value = NOTHING
        self._last[element] = found, value
        return value
