"""Requirements on a recorded run: the monitors of runs follow the recorded steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from math import isfinite
from types import SimpleNamespace
from typing import Any

from specc_runtime.buffers import slots
from specc_runtime.forms import Element, Layout, NotRecorded
from specc_runtime.recording.messages import NOTHING, Shelved, simulated_s, step_of, within
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
        self._told = {
            topic_of(name): _Told(name, ticks, x, _elements(read.get(name, ()), layouts), shelf)
            for name, (x, ticks) in owners.items()
        }
        followed = {told.name: (told, told.ticks) for told in self._told.values()}
        self._requirements.follow(followed, system.tick_s)

    def begin(self, saved: Mapping[str, Any], values: Values) -> None:
        """Go on from a snapshot; raises one of WRONG for data that is no snapshot."""
        known, tick = saved.get("requirements", ()), int(saved["tick"])
        self._requirements.restore(known, tick, partial(values.found, "requirements"))
        stamps = {**saved["stamps"], PLANT: saved["tick"] - 1}
        for told in self._told.values():
            told.begin(int(stamps.get(told.name, -1)) + 1)  # a new subsystem has no steps

    def take(self, topic: str, text: bytes) -> None:
        """Note a message; raises Misshapen."""
        told = self._told.get(topic)
        if told is not None and not told.is_over:
            self._note(told, told.follow(text, self._tick_s))

    def _note(self, told: _Told, record: StepRecord | None) -> None:
        if record is not None:
            self._requirements(record)
            self._requirements.advance(record.stamp * told.ticks)

    def finish(self, until_s: float) -> None:
        """End the run, at the end of the recording."""
        for told in self._told.values():
            self._note(told, told.end(self._tick_s))
        begun = max((told.begun for told in self._told.values()), default=0)
        settled = max((told.settled for told in self._told.values()), default=0)
        total_s = simulated_s(self._shelf.report)
        end = begun + 1 if total_s is None else round(total_s / self._tick_s)
        if isfinite(until_s):
            end = min(end, int(until_s / self._tick_s + 1e-6) + 1)
        self._requirements.finish(min(end, settled))

    @property
    def violated(self) -> bool:
        """Whether a requirement is violated."""
        return self._requirements.violated

    def as_data(self) -> list[dict[str, Any]]:
        """The entries of the report of a run; `missing` names the values that the file lacks."""
        found = self._requirements.as_data()
        known = {item for told in self._told.values() for item in told.known}
        absent = {r.attribute for r in self._requirements.readings} - known
        for data, requirement in zip(found, self._requirements.requirements, strict=True):
            data["missing"] = [
                n for n, attribute in requirement.reads.items() if attribute in absent
            ]
        return found


def _is_about(told_s: Any, time_s: float) -> bool:
    return isinstance(told_s, int | float) and abs(told_s - time_s) < _ROUNDING_S


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


class _Told:
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
        self._stamp = 0
        self._held: tuple[str, list[tuple[Reading, str, Any]]] | None = None
        """The values of the last step, which hold until the next step."""
        self._last: dict[Element, tuple[Any, Any]] = {}

    def begin(self, stamp: int) -> None:
        """The next step has this stamp."""
        self._stamp = stamp

    @property
    def begun(self) -> int:
        """The tick of its last step."""
        return max(0, self._stamp - 1) * self.ticks

    @property
    def settled(self) -> int:
        """The tick until which its values are known."""
        return self._stamp * self.ticks

    def follow(self, text: bytes, tick_s: float) -> StepRecord | None:
        """Note a step; returns the record of the step before, which ends here.

        None before the first step, and from the first incomplete step on.
        """
        told = loaded(text) if self.name == PLANT else step_of(text)
        held, stamp = self._held, self._stamp + (self._held is not None)
        self._held = None
        if not isinstance(told, dict) or not {"y", "stamp"} <= told.keys():
            self.is_over = True  # the step failed
        elif told["stamp"] != stamp:
            self.is_over = True  # steps before it are missing
        elif not _is_about(told.get("time"), stamp * self.ticks * tick_s):
            self.is_over, held = True, None  # it had another rate
        else:
            self._held = (
                told.get("state", ""),
                [
                    (reading, part, self._value(told.get(part), element) if element else NOTHING)
                    for reading, part, element in self._readings
                ],
            )
        return held and self._record(*held, tick_s)

    def end(self, tick_s: float) -> StepRecord | None:
        """The record of the last step."""
        held, self._held = self._held, None
        return held and self._record(*held, tick_s)

    def _record(
        self, state: str, found: Sequence[tuple[Reading, str, Any]], tick_s: float
    ) -> StepRecord:
        sent = {}
        for reading, part, value in found:
            if value is not NOTHING:
                if part == "y":
                    sent[reading.element] = value
                else:
                    setattr(getattr(self, part), reading.element, value)
            if value is not NOTHING or reading.kind == "state":
                self.known.add(reading.attribute)
        time_s = self._stamp * self.ticks * tick_s
        record = StepRecord(self.name, self._stamp, time_s, state, -1, tuple(sent.items()))
        self._stamp += 1
        return record

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
