"""Traces of a recorded run over time: states, chosen elements, faults and requirements.

Files come from strangers: memory for their data is paid for from a budget.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from pathlib import Path
from typing import Any

from specc_runtime.forms import Misshapen
from specc_runtime.recording.messages import (
    Beginning,
    Shelved,
    beginning_of,
    entries_of,
    first_of,
    report_of,
    simulated_s,
    step_of,
    steps_of,
)
from specc_runtime.recording.reading import RecordFile, Unusable
from specc_runtime.recording.steps import topic_of
from specc_runtime.recording.text import loaded
from specc_runtime.sampling import PLANT

_OF_SUBSYSTEM, _OF_SPAN = 2000, 300
"""Bytes that are kept for a subsystem, and for a span of time in one state."""
_LONGEST = 300
"""Characters that are kept of a text."""
_MOST_MARKS = 100
"""Faults and violated requirements that are kept."""
_FAULT = b',"fault":'


@dataclass(frozen=True, slots=True)
class Wanted:
    """An element in the messages of a subsystem: its path in the data, and its count of numbers.

    `numbers` converts its data, with NaN for missing values.
    """

    path: tuple[str, ...]
    width: int
    numbers: Callable[[Any], Sequence[float]]


@dataclass(slots=True)
class Span:
    """A span of time in s in which a subsystem was in one state."""

    begin_s: float
    end_s: float
    state: str


@dataclass(slots=True)
class Line:
    """A subsystem over time.

    `times_s` and the `columns` of the wanted elements have one value for each step, and NaN where
    steps are missing.
    """

    spans: list[Span] = field(default_factory=list)
    times_s: array[float] = field(default_factory=lambda: array("d"))
    columns: list[list[array[float]]] = field(default_factory=list)
    _stamp: int = -1

    def follow(self, time_s: float, begun: Beginning) -> int:
        """Note a step; returns the number of spans that it adds. Raises Misshapen."""
        if self.spans and time_s < self.spans[-1].end_s:
            raise Misshapen(f"the step before was later, at {self.spans[-1].end_s:.12g} s")
        is_next, before, state = self.is_next(begun), len(self.spans), begun.state[:_LONGEST]
        self._stamp = begun.stamp
        if self.spans and is_next:
            self.spans[-1].end_s = time_s
        if not self.spans or not is_next or self.spans[-1].state != state:
            self.spans.append(Span(time_s, time_s, state))
        return len(self.spans) - before

    def is_next(self, begun: Beginning) -> bool:
        """Whether no step is missing before that one."""
        return begun.first == self._stamp + 1

    def add(self, time_s: float, rows: Sequence[Sequence[float]]) -> None:
        """Add the numbers of each wanted element in a step."""
        self.times_s.append(time_s)
        for columns, numbers in zip(self.columns, rows, strict=True):
            for column, number in zip(columns, numbers, strict=True):
                column.append(number)

    def finish(self, end_s: float) -> None:
        """Extend the last state to the end of the run."""
        if self.spans and self.spans[-1].end_s < end_s:
            self.spans[-1].end_s = end_s


@dataclass(slots=True)
class Traces:
    """A run: its subsystems by name, and its failures, each a time in s and a text."""

    lines: dict[str, Line] = field(default_factory=dict)
    faults: list[tuple[float, str]] = field(default_factory=list)
    violated: list[tuple[float, str]] = field(default_factory=list)
    begin_s: float = 0.0
    end_s: float = 0.0


def traces(file: Path, wanted: Mapping[str, Sequence[Wanted]], reading: RecordFile) -> Traces:
    """The states of all subsystems, and the wanted elements, by subsystem or `plant`.

    Raises Unusable.
    """
    shelf, found = Shelved(0), Traces(begin_s=float("inf"))
    topics = {topic_of(name): elements for name, elements in wanted.items()}
    for topic, at_s, text in steps_of(reading, shelf, images=False):
        found.begin_s, found.end_s = min(found.begin_s, at_s), max(found.end_s, at_s)
        try:
            _take(found, topic, at_s, text, topics.get(topic, ()), reading)
        except Misshapen as error:
            raise Unusable(f"{file}: {topic} at {at_s:.12g} s: {error}") from None
    if found.begin_s > found.end_s:
        raise Unusable(f"{file} has no steps")
    found.end_s = reading.end_s(found.end_s, simulated_s(shelf.report))
    for line in found.lines.values():
        line.finish(found.end_s)
    _take_report(found, shelf)
    return found


def _take(
    found: Traces,
    topic: str,
    at_s: float,
    text: bytes,
    wanted: Sequence[Wanted],
    reading: RecordFile,
) -> None:
    """Note a message. Raises Misshapen, Unusable."""
    name, is_plant = topic[1:], topic == topic_of(PLANT)
    if is_plant and not wanted:
        return
    if name not in found.lines:
        reading.budget.keep(_OF_SUBSYSTEM + len(topic))
        columns = [[array("d") for _ in range(each.width)] for each in wanted]
        found.lines[name] = Line(columns=columns)
    line = found.lines[name]
    message = (loaded(text) if is_plant else step_of(text)) if wanted or _FAULT in text else {}
    begun = _of_plant(message) if is_plant else beginning_of(text)
    if wanted:
        blank = [[nan] * each.width for each in wanted]
        rows = [_numbers(each, message) for each in wanted]
        size = 8 * (1 + sum(each.width for each in wanted))
        reading.budget.keep(2 * size)
        if not line.is_next(begun) and line.times_s:
            line.add(at_s, blank)
        line.add(at_s, rows)
    more = line.follow(at_s, begun)
    reading.budget.keep(more * _OF_SPAN)
    if fault := message.get("fault"):
        _mark(found.faults, at_s, f"{name}: {fault}")


def _of_plant(message: Any) -> Beginning:
    if not isinstance(message, dict):
        raise Misshapen("a message of the plant that is no object")
    first = first_of(message)
    return Beginning(message["stamp"], first, "", "", -1, "")


def _numbers(wanted: Wanted, message: Mapping[str, Any]) -> Sequence[float]:
    data: Any = message
    for name in wanted.path:
        if not isinstance(data, dict) or name not in data:
            return [nan] * wanted.width
        data = data[name]
    return wanted.numbers(data)


def _mark(marks: list[tuple[float, str]], time_s: float, text: str) -> None:
    if len(marks) < _MOST_MARKS:
        marks.append((time_s, text[:_LONGEST]))


def _take_report(found: Traces, shelf: Shelved) -> None:
    """Add faults and violations from the report, if any: it knows more than the steps."""
    report = report_of(shelf.report)
    faults = entries_of(report, "faults", ("culprit", "message"))
    if faults:
        found.faults.clear()
    for time_s, entry in faults:
        _mark(found.faults, time_s, f"{entry['culprit'][:_LONGEST]}: {entry['message']}")
    for time_s, entry in entries_of(report, "requirements", ("that", "verdict")):
        if entry["verdict"] == "violated":
            _mark(found.violated, time_s, str(entry.get("name", entry["that"])))
