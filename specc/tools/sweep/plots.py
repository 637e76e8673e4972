"""Plots of a sweep over one or two constants; the same cells give the same bytes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import count, islice
from math import nan
from pathlib import Path
from textwrap import fill, shorten
from typing import Any

from specc.atomic_files import write_atomically
from specc.reachable import grouped
from specc.tools.canvas import content, figure
from specc.tools.sweep.running import STEPS
from specc.tools.sweep.summary import Cell

_LONGEST_LINE = 48
_LONGEST_TITLE = 4 * _LONGEST_LINE
_TICKS, _TEXTS = 24, 576
"""Labels along an axis, and cells of a heat map that have their value in them: more are illegible,
and take minutes to place."""
MOST = 50
"""Columns that are drawn."""


def plot(cells: Sequence[Cell], names: Sequence[str], folder: Path) -> list[Path]:
    """Draw what differs between the cells, `MOST` columns of it, each as PNG and SVG; the files.

    Over one constant a line with its intervals, over two a heat map; over none or more nothing.

    Raises:
        ModuleNotFoundError: matplotlib is not installed.
        OSError: a file cannot be written.
    """
    if len(names) not in (1, 2) or len(cells) < 2:
        return []
    drawn: list[Path] = []
    for column in islice(differing(cells), MOST):
        with figure(5.2, 3.4) as made:
            (_line if len(names) == 1 else _map)(made.subplots(), cells, names, column)
            folder.mkdir(exist_ok=True)
            drawn += _saved(made, folder / _stem(column, drawn))
    return drawn


def differing(cells: Sequence[Cell]) -> Iterator[str]:
    """The columns whose estimates differ."""
    values = grouped((column, e.value) for cell in cells for column, e in cell.estimates.items())
    for column, found in values.items():
        if column == "success" or (len(set(found)) > 1 and not column.startswith(STEPS)):
            yield column


def _stem(column: str, drawn: Sequence[Path]) -> str:
    """A name that no plot has yet; requirements may begin alike."""
    stem = re.sub(r"[^\w.-]+", "_", column, flags=re.ASCII)[:80]
    taken = {path.stem for path in drawn}
    return next(name for n in count(1) if (name := f"{stem}_{n}" if n > 1 else stem) not in taken)


def _saved(made: Any, stem: Path) -> Iterator[Path]:
    for form in ("png", "svg"):
        path = stem.with_name(f"{stem.name}.{form}")
        write_atomically(path, content(made, form))
        yield path


def _scale(values: Sequence[float | str]) -> tuple[list[float], list[str]]:
    """Where values lie on an axis, and what stands there."""
    numbers = [value for value in values if not isinstance(value, str)]
    if len(numbers) == len(values):
        return numbers, [f"{number:g}" for number in numbers]
    return [float(i) for i in range(len(values))], list(map(str, values))


def _few(places: Sequence[float], labels: Sequence[str]) -> tuple[list[float], list[str]]:
    """Places of ticks and their labels, evenly thinned out."""
    step = -(-len(labels) // _TICKS)
    return list(places[::step]), list(labels[::step])


def _line(axes: Any, cells: Sequence[Cell], names: Sequence[str], column: str) -> None:
    places, ticks = _scale([cell.values[0] for cell in cells])
    known = [(x, e) for x, c in zip(places, cells, strict=True) if (e := c.estimates.get(column))]
    xs, ys = [x for x, _ in known], [e.value for _, e in known]
    # Where there is no interval nothing is drawn: one of no length would look like certainty.
    below = [nan if e.low is None else e.value - e.low for _, e in known]
    above = [nan if e.high is None else e.high - e.value for _, e in known]
    axes.errorbar(xs, ys, (below, above), fmt="o-", capsize=3, markersize=4, linewidth=1.2)
    axes.set_xticks(*_few(places, ticks))
    axes.set_xlabel(names[0])
    axes.set_ylabel(_titled(column))
    axes.grid(axis="y", linewidth=0.4, alpha=0.6)
    if _is_rate(cells, column):
        axes.set_ylim(-0.03, 1.03)


def _map(axes: Any, cells: Sequence[Cell], names: Sequence[str], column: str) -> None:
    first, second = (list(dict.fromkeys(c.values[i] for c in cells)) for i in (0, 1))
    known = {cell.values: e.value for cell in cells if (e := cell.estimates.get(column))}
    grid = [[known.get((x, y), nan) for x in first] for y in second]
    is_rate = _is_rate(cells, column)
    low, high = (0.0, 1.0) if is_rate else (None, None)
    image = axes.imshow(grid, vmin=low, vmax=high, origin="lower", aspect="auto")
    is_legible = len(first) * len(second) <= _TEXTS
    for row, y in enumerate(second if is_legible else ()):
        for col, x in enumerate(first):
            if (x, y) in known:
                value = known[x, y]
                text = f"{100 * value:.0f} %" if is_rate else f"{value:.3g}"
                axes.text(col, row, text, ha="center", va="center", color=_ink(image, value))
    for values, name, set_ticks, set_label in (
        (first, names[0], axes.set_xticks, axes.set_xlabel),
        (second, names[1], axes.set_yticks, axes.set_ylabel),
    ):
        set_ticks(*_few(range(len(values)), _scale(values)[1]))
        set_label(name)
    axes.set_title(_titled(column), fontsize=9)
    axes.figure.colorbar(image, ax=axes)


def _ink(image: Any, value: float) -> str:
    """Black on light colours, white on dark ones."""
    red, green, blue, _ = image.cmap(image.norm(value))
    return "black" if 0.3 * red + 0.59 * green + 0.11 * blue > 0.5 else "white"


def _is_rate(cells: Sequence[Cell], column: str) -> bool:
    return all(e.is_rate for cell in cells if (e := cell.estimates.get(column)))


def _titled(column: str) -> str:
    words = column.replace("cycle.", "cycle: ").replace("_", " ")
    return fill(shorten(words, _LONGEST_TITLE), _LONGEST_LINE)
