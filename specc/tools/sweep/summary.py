"""Estimates of a sweep for each setting: rates and medians with intervals of 95 %, and plots."""

from __future__ import annotations

import re
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import count, islice
from math import exp, lgamma, log, nan, sqrt
from pathlib import Path
from textwrap import fill, shorten
from typing import Any

from specc.atomic_files import write_atomically
from specc.reachable import grouped
from specc.tools.canvas import content, figure
from specc.tools.sweep.running import PREMISE, STEPS, VERDICT
from specc.tools.sweep.table import Row, columns_of

# Estimates.

Z = 1.959963984540054
"""Of the normal distribution at 97.5 %."""
_TAIL = 0.025
_MET = {"met": True, "violated": False}
# Not measured: how the run was made.
_NOT_MEASURED = ("seed", "wall_s")


@dataclass(frozen=True, slots=True)
class Estimate:
    """A rate or a median of `count` runs, and the interval that has it with 95 %."""

    count: int
    value: float
    low: float | None
    high: float | None
    is_rate: bool = False


@dataclass(frozen=True, slots=True)
class Cell:
    """The runs of one setting: its values, and an estimate for each column that has any."""

    values: tuple[float | str, ...]
    runs: int
    estimates: dict[str, Estimate]


def rate(hits: int, count: int) -> Estimate:
    """How often something is the case, with the interval of Wilson (1927)."""
    share = hits / count
    spread = Z * sqrt(share * (1 - share) / count + Z * Z / (4 * count * count))
    middle, whole = share + Z * Z / (2 * count), 1 + Z * Z / count
    low = 0.0 if hits == 0 else (middle - spread) / whole
    high = 1.0 if hits == count else (middle + spread) / whole
    return Estimate(count, share, low, high, is_rate=True)


def median(numbers: Sequence[float]) -> Estimate:
    """The median, between two order statistics; they need six numbers, and no distribution."""
    ordered, count = sorted(numbers), len(numbers)
    rank, value = _lower_rank(count), float(statistics.median(ordered))
    low, high = (ordered[rank - 1], ordered[count - rank]) if rank else (None, None)
    return Estimate(count, value, low, high)


@cache
def _lower_rank(count: int) -> int:
    """The 1-based rank of the order statistic that bounds the 95 % interval of the median.

    0 if `count` numbers are too few.
    """
    rank, tail = 0, 0.0
    while True:  # the binomial distribution at 1/2, in logarithms: its terms are tiny
        ways = lgamma(count + 1) - lgamma(rank + 1) - lgamma(count - rank + 1)
        tail += exp(ways - count * log(2))
        if tail > _TAIL:
            return rank
        rank += 1


def cells_of(rows: Sequence[Row], names: Sequence[str]) -> list[Cell]:
    """One for each combination of values of the constants `names`, in the order of the rows."""
    groups = grouped((tuple(row[name] for name in names), row) for row in rows)
    columns = {c: i for i, c in enumerate(columns_of(rows)) if c not in (*names, *_NOT_MEASURED)}
    return [Cell(values, len(own), _estimates(own, columns)) for values, own in groups.items()]


def _estimates(rows: Sequence[Row], columns: Mapping[str, int]) -> dict[str, Estimate]:
    found = {}
    own = {name for row in rows for name in row if name in columns}
    for column in sorted(own, key=columns.__getitem__):
        every = [row.get(column) for row in rows]
        if column.startswith(VERDICT):
            every = [_MET.get(str(verdict)) for verdict in every]
        values = [value for value in every if value is not None]
        if values and all(isinstance(value, bool) for value in values):
            found[column] = rate(sum(values), len(values))
        elif values and all(isinstance(value, int | float) for value in values):
            found[column] = median(values)
    return found


def as_rows(cells: Sequence[Cell], names: Sequence[str]) -> list[Row]:
    """The cells as a table: of every column the estimate, its interval, and of how many runs."""
    rows: list[Row] = []
    for cell in cells:
        rows.append({**dict(zip(names, cell.values, strict=True)), "runs": cell.runs})
        for name, e in cell.estimates.items():
            rows[-1] |= {name: e.value, f"{name} low": e.low, f"{name} high": e.high}
            rows[-1][f"{name} runs"] = e.count
    return rows


def as_text(cells: Sequence[Cell], names: Sequence[str]) -> list[list[str]]:
    """What people see: success of every setting, of the runs in which it was decided."""
    lines = [[*names, "runs", "success", "95 %", "undecided"]]
    for cell in cells:
        success = cell.estimates.get("success")
        shown = [v if isinstance(v, str) else f"{v:.12g}" for v in cell.values]
        share, interval, undecided = "", "", cell.runs
        if success:
            share = percent(success.value)
            interval = f"{percent(success.low)} to {percent(success.high)}"
            undecided -= success.count
        lines.append([*shown, str(cell.runs), share, interval, str(undecided)])
    return lines if any(line[-1] != "0" for line in lines[1:]) else [line[:-1] for line in lines]


def worst(cells: Sequence[Cell], most: int) -> list[Cell]:
    """At most so many cells, in their order: those with the least success."""

    def success(index: int) -> float:
        known = cells[index].estimates.get("success")
        return known.value if known else 0.0

    return [cells[index] for index in sorted(sorted(range(len(cells)), key=success)[:most])]


def reasons(rows: Sequence[Row]) -> list[tuple[str, list[int]]]:
    """Why runs did not succeed, or were not decided, and which rows these are.

    The most frequent reason comes first.
    """
    words = {None: "", False: "not successful: "}
    failed = ((n, row) for n, row in enumerate(rows) if not row["success"])
    found = grouped((words[row["success"]] + row["reason"], n) for n, row in failed)
    return sorted(found.items(), key=lambda item: (-len(item[1]), item[0]))


def rarely_triggered(rows: Sequence[Row]) -> Iterator[str]:
    """For each requirement that was not triggered in every run: in how many it was, and was met."""
    for column in columns_of(rows):
        tested = [row[column] for row in rows if row.get(column) is not None]
        if column.startswith(PREMISE) and not all(tested):
            label = column.removeprefix(PREMISE)
            verdicts = [row.get(f"{VERDICT}{label}") for row in rows]
            known = sum(verdict is not None for verdict in verdicts)
            met, often = verdicts.count("met"), sum(tested)
            yield f"{label}: met in {met} of {known}, asked in {often or 'none'}"


def percent(share: Any) -> str:
    """A share as people read it."""
    return f"{100 * share:.1f} %"


# Plots over one or two constants; the same cells give the same bytes.

_LONGEST_LINE = 48
_LONGEST_TITLE = 4 * _LONGEST_LINE
_TICKS, _TEXTS = 24, 576
"""Labels along an axis, and cells of a heat map that have their value in them: more are illegible,
and take minutes to place."""
MOST = 50
"""Columns that are drawn."""


def plot(cells: Sequence[Cell], names: Sequence[str], folder: Path) -> list[Path]:
    """Draw at most `MOST` columns, each as PNG and SVG; returns the files.

    Over one constant a line with its intervals, over two a heat map; over none or more nothing.

    Raises:
        ModuleNotFoundError: matplotlib is not installed.
        OSError: a file cannot be written.
    """
    if len(names) not in (1, 2) or len(cells) < 2:
        return []
    files: list[Path] = []
    for column in islice(columns_to_plot(cells), MOST):
        with figure(5.2, 3.4) as made:
            (_line if len(names) == 1 else _map)(made.subplots(), cells, names, column)
            folder.mkdir(exist_ok=True)
            # Requirements may begin alike.
            stem = re.sub(r"[^\w.-]+", "_", column, flags=re.ASCII)[:80]
            stems = (f"{stem}_{n}" if n > 1 else stem for n in count(1))
            name = next(name for name in stems if folder / f"{name}.png" not in files)
            for form in ("png", "svg"):
                files.append(folder / f"{name}.{form}")
                write_atomically(files[-1], content(made, form))
    return files


def columns_to_plot(cells: Sequence[Cell]) -> Iterator[str]:
    """`success`, and every other column whose estimates differ between settings.

    The steps of states are left out.
    """
    values = grouped((column, e.value) for cell in cells for column, e in cell.estimates.items())
    for column, found in values.items():
        if column == "success" or (len(set(found)) > 1 and not column.startswith(STEPS)):
            yield column


def _ticks(values: Sequence[float | str]) -> tuple[list[float], list[str]]:
    """Where values lie on an axis, and their labels."""
    numbers = [value for value in values if not isinstance(value, str)]
    if len(numbers) == len(values):
        return numbers, [f"{number:g}" for number in numbers]
    return [float(i) for i in range(len(values))], list(map(str, values))


def _line(axes: Any, cells: Sequence[Cell], names: Sequence[str], column: str) -> None:
    places, labels = _ticks([cell.values[0] for cell in cells])
    known = [(x, e) for x, c in zip(places, cells, strict=True) if (e := c.estimates.get(column))]
    xs, ys = [x for x, _ in known], [e.value for _, e in known]
    # Where there is no interval nothing is drawn: one of no length would look like certainty.
    below = [nan if e.low is None else e.value - e.low for _, e in known]
    above = [nan if e.high is None else e.high - e.value for _, e in known]
    axes.errorbar(xs, ys, (below, above), fmt="o-", capsize=3, markersize=4, linewidth=1.2)
    step = -(-len(labels) // _TICKS)
    axes.set_xticks(places[::step], labels[::step])
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
                red, green, blue, _ = image.cmap(image.norm(value))
                is_light = 0.3 * red + 0.59 * green + 0.11 * blue > 0.5
                ink = "black" if is_light else "white"
                axes.text(col, row, text, ha="center", va="center", color=ink)
    for values, name, axis in ((first, names[0], axes.xaxis), (second, names[1], axes.yaxis)):
        step = -(-len(values) // _TICKS)
        axis.set_ticks(range(len(values))[::step], _ticks(values)[1][::step])
        axis.set_label_text(name)
    axes.set_title(_titled(column), fontsize=9)
    axes.figure.colorbar(image, ax=axes)


def _is_rate(cells: Sequence[Cell], column: str) -> bool:
    return all(e.is_rate for cell in cells if (e := cell.estimates.get(column)))


def _titled(column: str) -> str:
    words = column.replace("cycle.", "cycle: ").replace("_", " ")
    return fill(shorten(words, _LONGEST_TITLE), _LONGEST_LINE)
