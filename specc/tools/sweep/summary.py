"""What a sweep says of each setting: rates and medians with intervals of 95 %."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb, sqrt
from typing import Any

from specc.frozen import frozen
from specc.tools.sweep.table import Row, columns_of

Z = 1.959963984540054
"""Of the normal distribution at 97.5 %."""
_MISSED = 0.025
# Not measured: how the run was made.
_ASIDE = ("seed", "wall_s")


@frozen
class Estimate:
    """A rate or a median of `count` runs, and the interval that has it with 95 %."""

    count: int
    value: float
    low: float | None
    high: float | None
    is_rate: bool = False


@frozen
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
    value = (ordered[(count - 1) // 2] + ordered[count // 2]) / 2
    rank, tail = 0, 0.0  # so many numbers may be left out on either side
    while (tail := tail + comb(count, rank) / 2**count) <= _MISSED:
        rank += 1
    if rank == 0:
        return Estimate(count, value, None, None)
    return Estimate(count, value, ordered[rank - 1], ordered[count - rank])


def cells_of(rows: Sequence[Row], names: Sequence[str]) -> list[Cell]:
    """One for each combination of values of the constants `names`, in the order of the rows."""
    groups: dict[tuple[float | str, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in names), []).append(row)
    columns = [c for c in columns_of(rows) if c not in (*names, *_ASIDE)]
    return [Cell(values, len(own), _estimates(own, columns)) for values, own in groups.items()]


def _estimates(rows: Sequence[Row], columns: Sequence[str]) -> dict[str, Estimate]:
    found = {}
    for column in columns:
        values = [value for row in rows if (value := row.get(column)) is not None]
        if values and all(isinstance(value, bool) for value in values):
            found[column] = rate(sum(values), len(values))
        elif values and all(isinstance(value, int | float) for value in values):
            found[column] = median(values)
    return found


def as_rows(cells: Sequence[Cell], names: Sequence[str]) -> list[Row]:
    """The cells as a table: of every column the estimate, and its interval under `low`, `high`."""
    return [
        {**dict(zip(names, cell.values, strict=True)), "runs": cell.runs, **_spread(cell)}
        for cell in cells
    ]


def _spread(cell: Cell) -> Row:
    spread: Row = {}
    for name, e in cell.estimates.items():
        spread |= {name: e.value, f"{name} low": e.low, f"{name} high": e.high}
    return spread


def as_text(cells: Sequence[Cell], names: Sequence[str]) -> list[list[str]]:
    """What people see: success of every setting."""
    head = [*names, "runs", "success", "95 %"]
    lines = []
    for cell in cells:
        success = cell.estimates["success"]
        between = f"{percent(success.low)} to {percent(success.high)}"
        shown = [v if isinstance(v, str) else f"{v:.12g}" for v in cell.values]
        lines.append([*shown, str(cell.runs), percent(success.value), between])
    return [head, *lines]


def reasons(rows: Sequence[Row]) -> list[tuple[str, int]]:
    """Why runs did not succeed, the most frequent reason first."""
    counts: dict[str, int] = {}
    for row in rows:
        if not row["success"]:
            counts[row["reason"]] = counts.get(row["reason"], 0) + 1
    return sorted(counts.items(), key=lambda item: (-item[1], item[0]))


def percent(share: Any) -> str:
    """A share as people read it."""
    return f"{100 * share:.1f} %"
