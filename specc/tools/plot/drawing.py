"""The picture of a plot: bands above, panels below, all over the same time."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from heapq import nlargest
from typing import Any

from specc.diagnostics.visible import visible
from specc.tools.canvas import content, figure, text_width
from specc.tools.plot.sheet import MANY, Band, Curve, Panel, Sheet, is_alone, legible

MOST_PANELS, MOST_BANDS = 12, 100
_WIDTH_IN = 10.0
_ROW_IN, _PANEL_IN, _FRAME_IN, _NOTE_IN = 0.25, 1.65, 0.75, 0.16
_SMALL, _POINTS_PER_IN = 7.0, 72
_MOST_NOTES, _LONGEST_NOTE, _LONGEST_NAME = 8, 130, 60
MOST_NAMES = 400
"""Spans of states that have names on them."""
_FIRST = "#e3e3e3"
_COLOURS = ("#8dd3c7", "#fdb462", "#80b1d3", "#fb8072", "#b3de69", "#bebada", "#fccde5", "#ffed6f",
            "#a6cee3", "#ccebc5", "#d9b38c", "#e5c494")  # fmt: skip
_LINES = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#17becf",
          "#7f7f7f", "#bcbd22", "#393b79", "#637939")  # fmt: skip
_DASHES: Any = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1.5, 1, 1.5)), (0, (8, 2)), (0, (2, 3)))
_FAULT, _VIOLATED = "#c00000", "#b35c00"


def drawn(sheet: Sheet, form: str) -> bytes:
    """The sheet as a file of a format. Raises ModuleNotFoundError without matplotlib."""
    rows = len(sheet.bands)
    notes = _notes(sheet)
    heights = ([max(rows * _ROW_IN, 0.3)] if rows else []) + [_PANEL_IN] * len(sheet.panels)
    height_in = sum(heights) + _FRAME_IN + _NOTE_IN * len(notes)
    with figure(_WIDTH_IN, height_in) as made, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of letters that the font does not have
        axes = made.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)
        every = [each[0] for each in axes]
        made.suptitle(_clean(sheet.title), fontsize=9, x=0.01, ha="left")
        for each, panel in zip(every[bool(rows) :], sheet.panels, strict=True):
            _draw_panel(each, panel)
        length_s = sheet.end_s - sheet.begin_s or 1.0
        every[-1].set_xlim(sheet.begin_s, sheet.begin_s + length_s)
        every[-1].set_xlabel("\n".join(["time (s)", *notes]), loc="left", fontsize=8)
        _mark(every, sheet)
        if rows:
            _draw_bands(every[0], sheet.bands, length_s)
            made.draw_without_rendering()
            _name_states(every[0], sheet.bands, length_s)
        return content(made, form)


def _clean(text: str, most: int = _LONGEST_NAME * 3) -> str:
    """A text of a stranger on one line of a picture."""
    shown = visible(" ".join(text[: 2 * most].split()))
    return shown if len(shown) <= most else f"{shown[: most - 1]}…"


def _notes(sheet: Sheet) -> list[str]:
    said = [
        f"{number} at {mark.time_s:.6g} s: {mark.text}"
        for number, mark in enumerate(sheet.marks[:_MOST_NOTES], start=1)
    ]
    if len(sheet.marks) > _MOST_NOTES:
        said.append(f"and {len(sheet.marks) - _MOST_NOTES} more")
    if sheet.still:
        said.append(f"always in one state: {', '.join(sheet.still)}")
    return [_clean(text, _LONGEST_NOTE) for text in said]


def _draw_bands(axes: Any, bands: Sequence[Band], length_s: float) -> None:
    for row, band in enumerate(bands):
        places = {state: place for place, state in enumerate(band.states)}
        shown = list(legible(band, length_s))
        spans = [(begin_s, end_s - begin_s) for begin_s, end_s, _ in shown]
        colours = [_colour(places, state) for *_, state in shown]
        axes.broken_barh(spans, (row - 0.42, 0.84), facecolors=colours, edgecolor="white", lw=0.3)
    axes.set_yticks(range(len(bands)), [_clean(b.label, _LONGEST_NAME) for b in bands], fontsize=8)
    axes.set_ylim(len(bands) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def _colour(places: Mapping[str, int], state: str) -> str:
    if state == MANY:
        return "#999999"
    place = places[state]
    return _COLOURS[(place - 1) % len(_COLOURS)] if place else _FIRST


def _name_states(axes: Any, bands: Sequence[Band], length_s: float) -> None:
    """Write the names of states where they fit, in the longest spans if there are many."""
    box = axes.get_window_extent()
    points_per_s = box.width / axes.figure.dpi * _POINTS_PER_IN / length_s
    widths: dict[str, float] = {}
    every = ((row, *s) for row, b in enumerate(bands) for s in legible(b, length_s) if s[2] != MANY)
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
    values = curve.values
    label = _clean(curve.label, _LONGEST_NAME) or None
    axes.plot(curve.times_s, values, color=colour, linestyle=dash, linewidth=0.9,
              drawstyle="steps-post", label=label)  # fmt: skip
    alone = [i for i in range(len(values)) if is_alone(values, i)]
    if alone:
        times_s = [curve.times_s[i] for i in alone]
        axes.plot(times_s, [values[i] for i in alone], ".", color=colour, markersize=3)


def _mark(every: Sequence[Any], sheet: Sheet) -> None:
    """Lines through all panels: transitions, faults, violated requirements."""
    for time_s in _changes(sheet) if sheet.panels else ():
        for axes in every[bool(sheet.bands) :]:
            axes.axvline(time_s, color="#888888", linewidth=0.4, alpha=0.7)
    for number, mark in enumerate(sheet.marks, start=1):
        colour, dash = (_FAULT, _DASHES[0]) if mark.is_fault else (_VIOLATED, _DASHES[1])
        for axes in every:
            axes.axvline(mark.time_s, color=colour, linewidth=1.0, linestyle=dash)
        every[0].annotate(str(number), (mark.time_s, 1.0), xycoords=("data", "axes fraction"),
                          ha="center", va="bottom", color=colour, fontsize=8)  # fmt: skip


def _changes(sheet: Sheet) -> Iterator[float]:
    """When machines went into another state, unless that is too often to be seen."""
    length_s = sheet.end_s - sheet.begin_s
    times_s = {s[0] for band in sheet.bands for s in legible(band, length_s)} - {sheet.begin_s}
    return iter(sorted(times_s) if len(times_s) <= _MOST_CHANGES else ())


_MOST_CHANGES = 200
