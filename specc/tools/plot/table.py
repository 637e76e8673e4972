"""The numbers of a plot as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence

from specc.tools.plot.sheet import Band, PlottedRun, numbers_of
from specc.tools.plot.signals import PlottedLine, Signal


def timeline(runs: Sequence[tuple[str, Sequence[Band]]]) -> str:
    """The spans in which machines were in their states."""
    rows = (
        [name, f"{begin_s:.9g}", f"{end_s:.9g}", band.label, state]
        for name, bands in runs
        for band in bands
        for begin_s, end_s, state in band.spans
    )
    return _text(["recording", "begin_s", "end_s", "subsystem", "state"], rows)


def table(runs: Sequence[PlottedRun], signals: Sequence[Signal], names: Sequence[str]) -> str:
    """A row for each time at which something is told; `names` are those of machines."""
    head = [_head(signal.name, part) for signal in signals for part in signal.components]
    rows = (row for run in runs for row in _rows(run, signals, names))
    return _text(["recording", "time_s", *names, *head], rows)


def _head(name: str, part: PlottedLine) -> str:
    dot = "." if part.name and part.name[0] != "[" else ""
    unit = f" [{part.unit}]" if part.unit else ""
    return f"{name}{dot}{part.name}{unit}"


def _rows(run: PlottedRun, signals: Sequence[Signal], names: Sequence[str]) -> Iterator[list[str]]:
    width = len(names) + sum(len(signal.components) for signal in signals)
    rows: dict[float, list[str]] = {}
    for column, name in enumerate(names):
        for span in run.traces.lines[name].spans if name in run.traces.lines else ():
            rows.setdefault(span.begin_s, [""] * width)[column] = span.state
    column = len(names)
    for signal in signals:
        times_s, values = numbers_of(signal, run)
        for part, numbers in zip(signal.components, values, strict=True):
            for time_s, number in zip(times_s, numbers, strict=True):
                rows.setdefault(time_s, [""] * width)[column] = _shown(part, number)
            column += 1
    states = [""] * len(names)
    for time_s in sorted(rows):
        states = [new or old for new, old in zip(rows[time_s], states, strict=False)]
        yield [run.name, f"{time_s:.9g}", *states, *rows[time_s][len(names) :]]


def _shown(part: PlottedLine, number: float) -> str:
    if math.isnan(number):
        return ""
    if part.words:
        return part.words[int(number)]
    return f"{number:.12g}"


def _text(head: list[str], rows: Iterable[list[str]]) -> str:
    """The table; the column of recordings only where there are several."""
    made = list(rows)
    first = 0 if any(row[0] for row in made) else 1
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows(row[first:] for row in [head, *made])
    return text.getvalue()
