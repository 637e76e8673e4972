"""What a plot has on it: bands of states, panels with lines, and marks of what went wrong."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

from specc.model.system import Subsystem, System
from specc.tools.plot.signals import PlottedLine, Signal, unwound

MANY = "…"
"""Stands for states that follow one another too fast to be told apart."""
_FINEST = 1500
"""Spans of equal length that can be told apart in a band."""


@dataclass(frozen=True, slots=True)
class Band:
    """The states of a machine over time: when each begins and ends, in s."""

    label: str
    spans: tuple[tuple[float, float, str], ...]
    states: tuple[str, ...]
    """In the order of their colours."""


@dataclass(frozen=True, slots=True)
class Curve:
    """One line. `kind` and `source` say how it looks: which component, of which signal and run."""

    label: str
    kind: int
    source: int
    times_s: Sequence[float]
    values: Sequence[float]


@dataclass(frozen=True, slots=True)
class Panel:
    """Lines of one unit. Where values have names, these stand at the axis."""

    title: str
    unit: str
    words: tuple[str, ...]
    curves: tuple[Curve, ...]


@dataclass(frozen=True, slots=True)
class Mark:
    """What went wrong at a time."""

    time_s: float
    text: str
    is_fault: bool


@dataclass(frozen=True, slots=True)
class Sheet:
    """All of a plot."""

    title: str
    bands: tuple[Band, ...]
    panels: tuple[Panel, ...]
    marks: tuple[Mark, ...]
    begin_s: float
    end_s: float
    still: tuple[str, ...] = ()
    """Machines that never left their only state, with it."""


@dataclass(frozen=True, slots=True)
class PlottedRun:
    """A recording that was read: its name on the plot, empty if it is the only one."""

    name: str
    traces: Any


def cut(run: PlottedRun, begin_s: float, end_s: float) -> PlottedRun:
    """What a recording has of a part of its time."""
    whole = run.traces
    begin_s, end_s = max(begin_s, whole.begin_s), min(end_s, whole.end_s)
    if (begin_s, end_s) == (whole.begin_s, whole.end_s):
        return run
    lines = {}
    for name, line in whole.lines.items():
        spans = [
            replace(span, begin_s=max(span.begin_s, begin_s), end_s=min(span.end_s, end_s))
            for span in line.spans
            if span.begin_s <= end_s and span.end_s >= begin_s
        ]
        inside = slice(bisect_left(line.times_s, begin_s), bisect_right(line.times_s, end_s))
        columns = [[column[inside] for column in columns] for columns in line.columns]
        lines[name] = replace(line, spans=spans, times_s=line.times_s[inside], columns=columns)
    faults, violated = (
        [mark for mark in every if begin_s <= mark[0] <= end_s]
        for every in (whole.faults, whole.violated)
    )
    own = {"lines": lines, "faults": faults, "violated": violated}
    return PlottedRun(run.name, replace(whole, begin_s=begin_s, end_s=end_s, **own))


def bands(
    runs: Sequence[PlottedRun], names: Sequence[str], system: System | None
) -> Iterator[Band]:
    """The machines of these names, each run below the other."""
    known = {s.qualified_name: s for s in system.subsystems} if system else {}
    for name in names:
        for run in runs:
            line = run.traces.lines.get(name)
            if line is not None:
                label = f"{name} ({run.name})" if run.name else name
                spans = [(s.begin_s, s.end_s, s.state) for s in line.spans]
                yield Band(label, tuple(spans), _states(known.get(name), spans))


def _states(subsystem: Subsystem | None, spans: Sequence[tuple[float, float, str]]) -> Any:
    """The initial state first, then those of the specification, then others as they come."""
    own: list[str] = [s.name for s in subsystem.states] if subsystem else []
    first = [subsystem.initial_state] if subsystem else []
    return tuple(dict.fromkeys([*first, *own, *(state for *_, state in spans)]))


def legible(band: Band, length_s: float) -> Iterator[tuple[float, float, str]]:
    """The spans of a band; those that are too short to be told apart are one."""
    shortest = length_s / _FINEST
    for is_short, group in groupby(band.spans, lambda span: span[1] - span[0] < shortest):
        spans = list(group)
        if is_short and len(spans) > 1:
            yield spans[0][0], spans[-1][1], MANY
        else:
            yield from spans


def panels(runs: Sequence[PlottedRun], groups: Sequence[Sequence[Signal]]) -> Iterator[Panel]:
    """The panels of each group of signals, one for each unit."""
    for group in groups:
        found: dict[Any, list[Curve]] = {}
        source = 0
        for signal in group:
            for run in runs:
                label = " ".join(filter(None, [signal.name if group[1:] else "", run.name]))
                for part, curve in _curves(signal, run, label, source):
                    found.setdefault((part.unit, part.words), []).append(curve)
                source += 1
        for (unit, words), curves in found.items():
            yield Panel(_title(group), unit, words, tuple(curves))


def _title(group: Sequence[Signal]) -> str:
    first = group[0]
    if len(group) > 1:
        return ", ".join(signal.name for signal in group)
    return f"{first.name}: {first.title}" if first.title else first.name


def _curves(
    signal: Signal, run: PlottedRun, label: str, source: int
) -> Iterator[tuple[PlottedLine, Curve]]:
    times_s, columns = numbers_of(signal, run)
    units: dict[Any, int] = {}
    for part, column in zip(signal.components, columns, strict=True):
        kind = units.setdefault((part.unit, part.words), 0)
        units[part.unit, part.words] += 1
        text = " ".join(filter(None, [part.name, label]))
        yield part, Curve(text, kind, source, times_s, column)


def numbers_of(signal: Signal, run: PlottedRun) -> tuple[Sequence[float], list[Any]]:
    """Times in s, and the values of each component then."""
    line = run.traces.lines.get(signal.owner)
    if line is None:
        return (), [()] * len(signal.components)
    columns: list[Any] = list(line.columns[signal.place])
    if signal.is_pose:
        turned = unwound(list(zip(*columns[3:], strict=True)))
        columns[3:] = [[vector[i] for vector in turned] for i in range(3)]
    return line.times_s, columns


def marks(runs: Sequence[PlottedRun]) -> Iterator[Mark]:
    """Faults and violated requirements, by time."""
    every = []
    for run in runs:
        where = f" ({run.name})" if run.name else ""
        every += [Mark(t, f"fault{where}: {said}", True) for t, said in run.traces.faults]
        every += [Mark(t, f"violated{where}: {said}", False) for t, said in run.traces.violated]
    return iter(sorted(every, key=lambda mark: mark.time_s))


def is_alone(values: Sequence[float], at: int) -> bool:
    """Whether a value has none beside it, so that no line leads to it."""
    before = values[at - 1] if at else math.nan
    after = values[at + 1] if at + 1 < len(values) else math.nan
    return math.isnan(before) and math.isnan(after) and not math.isnan(values[at])
