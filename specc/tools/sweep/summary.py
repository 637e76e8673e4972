"""What a sweep says of each setting: rates and medians with intervals of 95 %."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import exp, lgamma, log, sqrt
from typing import Any

from specc.reachable import grouped
from specc.tools.sweep.running import ASKED, VERDICT
from specc.tools.sweep.table import Row, columns_of

Z = 1.959963984540054
"""Of the normal distribution at 97.5 %."""
_MISSED = 0.025
_MET = {"met": True, "violated": False}
# Not measured: how the run was made.
_ASIDE = ("seed", "wall_s")


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
    rank, value = _spared(count), float(statistics.median(ordered))
    low, high = (ordered[rank - 1], ordered[count - rank]) if rank else (None, None)
    return Estimate(count, value, low, high)


@cache
def _spared(count: int) -> int:
    """Of so many numbers, those that lie outside the interval on either side, and one more."""
    rank, tail = 0, 0.0
    while True:  # the binomial distribution at 1/2, in logarithms: its terms are tiny
        ways = lgamma(count + 1) - lgamma(rank + 1) - lgamma(count - rank + 1)
        tail += exp(ways - count * log(2))
        if tail > _MISSED:
            return rank
        rank += 1


def cells_of(rows: Sequence[Row], names: Sequence[str]) -> list[Cell]:
    """One for each combination of values of the constants `names`, in the order of the rows."""
    groups = grouped((tuple(row[name] for name in names), row) for row in rows)
    columns = {c: i for i, c in enumerate(columns_of(rows)) if c not in (*names, *_ASIDE)}
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
    return [
        {**dict(zip(names, cell.values, strict=True)), "runs": cell.runs, **_spread(cell)}
        for cell in cells
    ]


def _spread(cell: Cell) -> Row:
    spread: Row = {}
    for name, e in cell.estimates.items():
        spread |= {name: e.value, f"{name} low": e.low, f"{name} high": e.high}
        spread[f"{name} runs"] = e.count
    return spread


def as_text(cells: Sequence[Cell], names: Sequence[str]) -> list[list[str]]:
    """What people see: success of every setting, of the runs in which it was decided."""
    lines = [[*names, "runs", "success", "95 %", "undecided"]]
    for cell in cells:
        success = cell.estimates.get("success")
        told = ["", "", str(cell.runs - (success.count if success else 0))]
        if success:
            told[:2] = percent(success.value), f"{percent(success.low)} to {percent(success.high)}"
        shown = [v if isinstance(v, str) else f"{v:.12g}" for v in cell.values]
        lines.append([*shown, str(cell.runs), *told])
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


def seldom_asked(rows: Sequence[Row]) -> Iterator[str]:
    """Of each requirement that was not asked in every run, in how many it was, and was met."""
    for column in columns_of(rows):
        told = [row[column] for row in rows if row.get(column) is not None]
        if column.startswith(ASKED) and not all(told):
            label = column.removeprefix(ASKED)
            verdicts = [row.get(f"{VERDICT}{label}") for row in rows]
            known = sum(verdict is not None for verdict in verdicts)
            met, often = verdicts.count("met"), sum(told)
            yield f"{label}: met in {met} of {known}, asked in {often or 'none'}"


def percent(share: Any) -> str:
    """A share as people read it."""
    return f"{100 * share:.1f} %"
