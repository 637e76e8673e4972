"""A plot of recordings as a picture or CSV: bands of states, panels with lines, marks of faults."""

from __future__ import annotations

import csv
import io
import math
import warnings
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from heapq import nlargest
from itertools import groupby, product
from typing import Any

from specc.diagnostics.visible import visible
from specc.model.system import Subsystem, System
from specc.tools.canvas import content, figure, text_width
from specc.tools.plot.signals import Signal, unwrap_rotations

# What is on it.

MANY = "…"
"""Stands for states that follow one another too fast to be told apart."""
_FINEST = 1500
"""Spans of equal length that can be told apart in a band."""


StateSpan = tuple[float, float, str]
"""Begin and end in s, and a state."""


@dataclass(frozen=True, slots=True)
class Band:
    """The states of a machine over time: when each begins and ends, in s."""

    label: str
    spans: tuple[StateSpan, ...]
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
    constant_machines: tuple[str, ...] = ()
    """Machines that never left their only state, with it."""


@dataclass(frozen=True, slots=True)
class PlottedRun:
    """A recording that was read: its name on the plot, empty if it is the only one."""

    name: str
    traces: Any


def clip(run: PlottedRun, begin_s: float, end_s: float) -> PlottedRun:
    """A part of the time of a recording."""
    traces = run.traces
    begin_s, end_s = max(begin_s, traces.begin_s), min(end_s, traces.end_s)
    lines = {}
    for name, line in traces.lines.items():
        spans = [
            replace(span, begin_s=max(span.begin_s, begin_s), end_s=min(span.end_s, end_s))
            for span in line.spans
            if span.begin_s <= end_s and span.end_s >= begin_s
        ]
        inside = slice(bisect_left(line.times_s, begin_s), bisect_right(line.times_s, end_s))
        columns = [[column[inside] for column in columns] for columns in line.columns]
        lines[name] = replace(line, spans=spans, times_s=line.times_s[inside], columns=columns)
    faults, violated = (
        [mark for mark in marks if begin_s <= mark[0] <= end_s]
        for marks in (traces.faults, traces.violated)
    )
    part = {"lines": lines, "faults": faults, "violated": violated}
    return PlottedRun(run.name, replace(traces, begin_s=begin_s, end_s=end_s, **part))


def bands(
    runs: Sequence[PlottedRun], names: Sequence[str], system: System | None
) -> Iterator[Band]:
    """The machines of these names, each run below the other."""
    known = {s.qualified_name: s for s in system.subsystems} if system else {}
    for name in names:
        subsystem = known.get(name)
        declared = [s.name for s in subsystem.states] if subsystem else []
        first = [subsystem.initial_state] if subsystem else []
        for run in runs:
            line = run.traces.lines.get(name)
            if line is not None:
                label = f"{name} ({run.name})" if run.name else name
                spans = tuple((s.begin_s, s.end_s, s.state) for s in line.spans)
                states = dict.fromkeys([*first, *declared, *(state for *_, state in spans)])
                yield from _mode_bands(label, subsystem, spans) if subsystem else ()
                yield Band(label, spans, tuple(states))


def _mode_bands(label: str, subsystem: Subsystem, spans: Sequence[StateSpan]) -> Iterator[Band]:
    """The modes in which a machine is over time, the inner ones below those around them."""
    around = {state.name: state.modes for state in subsystem.states}
    first = around.get(subsystem.initial_state, ())
    for depth in range(max(map(len, around.values()), default=0)):
        modes = {state: own[depth] for state, own in around.items() if len(own) > depth}
        names = dict.fromkeys((*first[depth : depth + 1], *modes.values()))
        title = f"{label} modes" if depth == 0 else ""
        yield Band(title, tuple(_in_modes(spans, modes)), tuple(names))


def _in_modes(spans: Sequence[StateSpan], modes: Mapping[str, str]) -> Iterator[StateSpan]:
    """The spans of states as those of modes, by the mode of each state that has one."""
    for mode, group in groupby(spans, lambda span: modes.get(span[2], "")):
        own = list(group)
        if mode:
            yield own[0][0], own[-1][1], mode


def merge_short_spans(band: Band, length_s: float) -> Iterator[StateSpan]:
    """The spans of a band; adjacent ones that are too short to be told apart are merged."""
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
        title = ", ".join(signal.name for signal in group)
        if len(group) == 1 and group[0].title:
            title += f": {group[0].title}"
        found: dict[Any, list[Curve]] = {}
        for source, (signal, run) in enumerate(product(group, runs)):
            times_s, columns = numbers_of(signal, run)
            kinds: Counter[Any] = Counter()
            for part, column in zip(signal.components, columns, strict=True):
                unit = part.unit, part.words
                names = part.name, signal.name if group[1:] else "", run.name
                label = " ".join(filter(None, names))
                curve = Curve(label, kinds[unit], source, times_s, column)
                found.setdefault(unit, []).append(curve)
                kinds[unit] += 1
        for (unit, words), curves in found.items():
            yield Panel(title, unit, words, tuple(curves))


def numbers_of(signal: Signal, run: PlottedRun) -> tuple[Sequence[float], list[Any]]:
    """Times in s, and the values of each component then."""
    line = run.traces.lines.get(signal.owner)
    if line is None:
        return (), [()] * len(signal.components)
    columns: list[Any] = list(line.columns[signal.place])
    if signal.is_pose:
        turned = unwrap_rotations(list(zip(*columns[3:], strict=True)))
        columns[3:] = [[vector[i] for vector in turned] for i in range(3)]
    return line.times_s, columns


def marks(runs: Sequence[PlottedRun]) -> list[Mark]:
    """Faults and violated requirements, by time."""
    every = []
    for run in runs:
        where = f" ({run.name})" if run.name else ""
        every += [Mark(t, f"fault{where}: {text}", True) for t, text in run.traces.faults]
        every += [Mark(t, f"violated{where}: {text}", False) for t, text in run.traces.violated]
    return sorted(every, key=lambda mark: mark.time_s)


# The picture: bands above, panels below, all over the same time.

MOST_PANELS, MOST_BANDS = 12, 100
_WIDTH_IN = 10.0
_ROW_IN, _PANEL_IN, _FRAME_IN, _NOTE_IN = 0.25, 1.65, 0.75, 0.16
_SMALL, _POINTS_PER_IN = 7.0, 72
_MOST_NOTES, _LONGEST_NOTE, _LONGEST_NAME = 8, 130, 60
MOST_NAMES = 400
"""Spans of states that have names on them."""
_MOST_CHANGES = 200
"""Transitions that can be seen as lines."""
_FIRST = "#e3e3e3"
_COLOURS = ("#8dd3c7", "#fdb462", "#80b1d3", "#fb8072", "#b3de69", "#bebada", "#fccde5", "#ffed6f",
            "#a6cee3", "#ccebc5", "#d9b38c", "#e5c494")  # fmt: skip
_LINES = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#17becf",
          "#7f7f7f", "#bcbd22", "#393b79", "#637939")  # fmt: skip
_DASHES: Any = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1.5, 1, 1.5)), (0, (8, 2)), (0, (2, 3)))
_FAULT, _VIOLATED = "#c00000", "#b35c00"


def render(sheet: Sheet, form: str) -> bytes:
    """The sheet as a file of a format. Raises ModuleNotFoundError without matplotlib."""
    rows = len(sheet.bands)
    notes = _notes(sheet)
    heights = ([max(rows * _ROW_IN, 0.3)] if rows else []) + [_PANEL_IN] * len(sheet.panels)
    height_in = sum(heights) + _FRAME_IN + _NOTE_IN * len(notes)
    with figure(_WIDTH_IN, height_in) as picture, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of letters that the font does not have
        axes = picture.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
        every = [each[0] for each in axes]
        picture.suptitle(_clean(sheet.title), fontsize=9, x=0.01, ha="left")
        for each, panel in zip(every[bool(rows) :], sheet.panels, strict=True):
            _draw_panel(each, panel)
        length_s = sheet.end_s - sheet.begin_s or 1.0
        every[-1].set_xlim(sheet.begin_s, sheet.begin_s + length_s)
        every[-1].set_xlabel("\n".join(["time (s)", *notes]), loc="left", fontsize=8)
        _mark(every, sheet)
        if rows:
            _draw_bands(every[0], sheet.bands, length_s)
            picture.draw_without_rendering()
            _name_states(every[0], sheet.bands, length_s)
        return content(picture, form)


def _clean(text: str, most: int = _LONGEST_NAME * 3) -> str:
    """A text of a stranger on one line of a picture."""
    shown = visible(" ".join(text[: 2 * most].split()))
    return shown if len(shown) <= most else f"{shown[: most - 1]}…"


def _notes(sheet: Sheet) -> list[str]:
    notes = [
        f"{number} at {mark.time_s:.6g} s: {mark.text}"
        for number, mark in enumerate(sheet.marks[:_MOST_NOTES], start=1)
    ]
    if len(sheet.marks) > _MOST_NOTES:
        notes.append(f"and {len(sheet.marks) - _MOST_NOTES} more")
    if sheet.constant_machines:
        notes.append(f"always in one state: {', '.join(sheet.constant_machines)}")
    return [_clean(text, _LONGEST_NOTE) for text in notes]


def _draw_bands(axes: Any, bands: Sequence[Band], length_s: float) -> None:
    for row, band in enumerate(bands):
        # The initial state is grey.
        states = zip(band.states, (_FIRST, *_COLOURS * len(band.states)), strict=False)
        colour_of = {MANY: "#999999", **dict(states)}
        shown = list(merge_short_spans(band, length_s))
        spans = [(begin_s, end_s - begin_s) for begin_s, end_s, _ in shown]
        colours = [colour_of[state] for *_, state in shown]
        axes.broken_barh(spans, (row - 0.42, 0.84), facecolors=colours, edgecolor="white", lw=0.3)
    axes.set_yticks(range(len(bands)), [_clean(b.label, _LONGEST_NAME) for b in bands], fontsize=8)
    axes.set_ylim(len(bands) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def _name_states(axes: Any, bands: Sequence[Band], length_s: float) -> None:
    """Write the names of states where they fit, in the longest spans if there are many."""
    box = axes.get_window_extent()
    points_per_s = box.width / axes.figure.dpi * _POINTS_PER_IN / length_s
    widths: dict[str, float] = {}
    every = (
        (row, *s)
        for row, b in enumerate(bands)
        for s in merge_short_spans(b, length_s)
        if s[2] != MANY
    )
    longest = nlargest(MOST_NAMES, every, lambda span: span[2] - span[1])
    for row, begin_s, end_s, state in sorted(longest):
        name = _clean(state, _LONGEST_NAME)
        if name not in widths:
            widths[name] = text_width(name, _SMALL) + 3
        if (end_s - begin_s) * points_per_s > widths[name]:
            at = ((begin_s + end_s) / 2, row)
            axes.text(*at, name, fontsize=_SMALL, ha="center", va="center_baseline")


def _draw_panel(axes: Any, panel: Panel) -> None:
    kinds = {curve.kind for curve in panel.curves}
    for curve in panel.curves:
        colour = curve.kind if len(kinds) > 1 else curve.source
        dash = curve.source if len(kinds) > 1 else 0
        _draw_curve(axes, curve, _LINES[colour % len(_LINES)], _DASHES[dash % len(_DASHES)])
    axes.set_title(_clean(panel.title), fontsize=8, loc="left", pad=3)
    axes.set_ylabel(panel.unit, fontsize=8)
    axes.grid(linewidth=0.3, alpha=0.6)
    axes.tick_params(labelsize=8)
    if panel.words:
        names = [_clean(word, 20) for word in panel.words]
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(-0.3, len(names) - 0.7)
    if any(curve.label for curve in panel.curves):
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=_SMALL, frameon=False,
                    borderaxespad=0.2, labelspacing=0.25)  # fmt: skip


def _draw_curve(axes: Any, curve: Curve, colour: str, dash: Any) -> None:
    times_s, values = curve.times_s, curve.values
    label = _clean(curve.label, _LONGEST_NAME) or None
    axes.plot(times_s, values, color=colour, linestyle=dash, linewidth=0.9,
              drawstyle="steps-post", label=label)  # fmt: skip
    # No line leads to a value between two that are missing.
    missing = [True, *map(math.isnan, values), True]
    points = [i for i in range(len(values)) if missing[i : i + 3] == [True, False, True]]
    if points:
        point_times_s = [times_s[i] for i in points]
        axes.plot(point_times_s, [values[i] for i in points], ".", color=colour, markersize=3)


def _mark(every: Sequence[Any], sheet: Sheet) -> None:
    """Lines through all panels: transitions, faults, violated requirements."""
    length_s = sheet.end_s - sheet.begin_s
    changes_s = {s[0] for band in sheet.bands for s in merge_short_spans(band, length_s)} - {
        sheet.begin_s
    }
    if sheet.panels and len(changes_s) <= _MOST_CHANGES:
        for time_s, axes in product(sorted(changes_s), every[bool(sheet.bands) :]):
            axes.axvline(time_s, color="#888888", linewidth=0.4, alpha=0.7)
    for number, mark in enumerate(sheet.marks, start=1):
        colour, dash = (_FAULT, _DASHES[0]) if mark.is_fault else (_VIOLATED, _DASHES[1])
        for axes in every:
            axes.axvline(mark.time_s, color=colour, linewidth=1.0, linestyle=dash)
        every[0].annotate(str(number), (mark.time_s, 1.0), xycoords=("data", "axes fraction"),
                          ha="center", va="bottom", color=colour, fontsize=8)  # fmt: skip


# The numbers as CSV.


def states_as_csv(runs: Sequence[tuple[str, Sequence[Band]]]) -> str:
    """The spans in which machines were in their states, as CSV."""
    rows = (
        [name, f"{begin_s:.9g}", f"{end_s:.9g}", band.label, state]
        for name, bands in runs
        for band in bands
        for begin_s, end_s, state in band.spans
    )
    return _text(["recording", "begin_s", "end_s", "subsystem", "state"], rows)


def table(runs: Sequence[PlottedRun], signals: Sequence[Signal], names: Sequence[str]) -> str:
    """A row for each time at which a value is recorded; `names` are those of machines."""
    head = ["recording", "time_s", *names]
    for signal in signals:
        for part in signal.components:
            dot = "." if part.name and part.name[0] != "[" else ""
            head.append(f"{signal.name}{dot}{part.name}" + (f" [{part.unit}]" if part.unit else ""))
    return _text(head, (row for run in runs for row in _rows(run, signals, names)))


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
                row = rows.setdefault(time_s, [""] * width)
                if not math.isnan(number):
                    row[column] = part.words[int(number)] if part.words else f"{number:.12g}"
            column += 1
    states = [""] * len(names)
    for time_s in sorted(rows):
        states = [new or old for new, old in zip(rows[time_s], states, strict=False)]
        yield [run.name, f"{time_s:.9g}", *states, *rows[time_s][len(names) :]]


def _text(head: list[str], rows: Iterable[list[str]]) -> str:
    """The table; the column of recordings only where there are several."""
    every = list(rows)
    first = 0 if any(row[0] for row in every) else 1
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(row[first:] for row in [head, *every])
    return text.getvalue()
