"""What is swept: values of constants, and seeds, as they are written on the command line."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, pairwise, product
from math import prod

from specc.model.units import UnitError, parse_unit
from specc.refusal import Refused
from specc.resolve.context import in_unit, quantity
from specc.tools.sweep.running import OWN

MOST_RUNS = 1_000_000
"""Of one sweep."""
MOST_SETTINGS = 10_000
"""Each has code of its own."""

_LONGEST_UNIT = 24
"""What is longer is compared as text: a folder of a stranger may have many of them."""

SweepSetting = Mapping[str, str]
"""Texts of the values of constants, by name."""

_BRACKETS = {"(": 1, "[": 1, "{": 1, ")": -1, "]": -1, "}": -1}


class SweepError(Refused):
    """The sweep cannot be made as asked; the message says why and what would help."""


@dataclass(frozen=True, slots=True)
class Axis:
    """The values that a constant takes, one after another."""

    name: str
    values: tuple[str, ...]
    unit: str | None
    """The unit of the values, empty if they have none; None unless they are numbers of one."""

    @property
    def title(self) -> str:
        """What stands over the values: `damping [kg/s]`, and no column of the table itself."""
        if self.unit:
            return f"{self.name} [{self.unit}]"
        if "." in self.name:
            return f"parameter {self.name}"
        return f"constant {self.name}" if self.name in OWN else self.name

    def shown(self, value: str) -> float | str:
        """A value below the title: a number, if all are."""
        number = quantity(value) if self.unit is not None else None
        return float(number[0]) if number is not None else value


def axis_of(name: str, text: str, unit: str = "") -> Axis:
    """`FROM:TO:COUNT`, both ends included, or values separated by commas.

    A number without a unit gets this one, if it is not empty.

    Raises:
        SweepError: it is neither, or a value is there twice.
    """
    ends = _split(text, ":")
    if len(ends) not in (1, 3):
        raise SweepError(f"--set {name}={text}: write FROM:TO:COUNT or values between commas")
    values = [value.strip() for value in (_split(text, ",") if len(ends) == 1 else ends[:2])]
    values = [in_unit(value, unit) for value in values]
    if len(ends) == 3:
        first, last = values
        values = _between(name, first, last, ends[2])
    if not all(values):
        raise SweepError(f"--set {name}={text}: a value is empty")
    # The same runs twice would pass for more of them.
    counts = Counter(keys := [meaning(value) for value in values])
    if twice := [v for v, key in zip(values, keys, strict=True) if counts[key] > 1]:
        raise SweepError(f"--set {name}={text}: {twice[-1]} is there twice")
    return Axis(name, tuple(values), _unit_of(values))


def _unit_of(values: Sequence[str]) -> str | None:
    found = [quantity(value) for value in values]
    units = {number[1] for number in found if number is not None}
    return units.pop() if None not in found and len(units) == 1 else None


def seeds_of(text: str) -> tuple[int, ...]:
    """`FROM:TO` without TO, or seeds separated by commas. Raises SweepError."""
    parts = [part.strip() for part in re.split("[:,]", text)]
    if not all(part.isascii() and part.isdigit() and len(part) < 19 for part in parts):
        way = "as in 0:10, or in 1,5,7"
        raise SweepError(f"--seeds {text}: seeds are whole numbers, 0 or more, {way}")
    numbers = [int(part) for part in parts]
    if ":" not in text:
        return tuple(dict.fromkeys(numbers))
    if "," in text or len(numbers) != 2 or numbers[0] >= numbers[1]:
        raise SweepError(f"--seeds {text}: write FROM:TO, where TO is no longer a seed, or 1,5,7")
    if numbers[1] - numbers[0] > MOST_RUNS:
        raise SweepError(f"--seeds {text}: more than {MOST_RUNS} runs")
    return tuple(range(*numbers))


def settings_of(axes: Sequence[Axis], seeds: Sequence[int]) -> list[dict[str, str]]:
    """Every combination of values, the last axis changing fastest. Raises SweepError."""
    count = prod(len(axis.values) for axis in axes)
    if count > MOST_SETTINGS or count * len(seeds) > MOST_RUNS:
        raise SweepError(
            f"{count} settings and {count * len(seeds)} runs are more than the "
            f"{MOST_SETTINGS} settings and {MOST_RUNS} runs of one sweep"
        )
    names = [axis.name for axis in axes]
    return [dict(zip(names, one, strict=True)) for one in product(*(a.values for a in axes))]


@lru_cache(MOST_SETTINGS)
def meaning(value: str) -> Hashable:
    """What is the same of 1, 1.0 and of 1[s], 1000[ms]; of all but quantities the text."""
    number = quantity(value)
    is_read = number is not None and len(number[1]) <= _LONGEST_UNIT
    try:
        unit = parse_unit(number[1] or "1") if number and is_read else None
    except UnitError:
        unit = None
    if number is None or unit is None:
        return value.strip()
    return unit.to_si(float(number[0])), unit.dimensions


def _between(name: str, first: str, last: str, count: str) -> list[str]:
    begin, end = quantity(first), quantity(last)
    if begin is None or end is None or begin[1] != end[1]:
        raise SweepError(f"--set {name}: {first} and {last} are not two numbers of one unit")
    count = count.strip()
    if not (
        count.isascii() and count.isdigit() and len(count) < 10 and 2 <= int(count) <= MOST_SETTINGS
    ):
        raise SweepError(
            f"--set {name}: COUNT is a whole number from 2 to {MOST_SETTINGS}, not {count!r}"
        )
    steps = int(count) - 1
    unit = f"[{begin[1]}]" if begin[1] else ""
    numbers = (begin[0] + (end[0] - begin[0]) * i / steps for i in range(steps + 1))
    return [f"{float(number):.12g}{unit}" for number in numbers]


def _split(text: str, sign: str) -> list[str]:
    """Parts of a text between signs that stand in no brackets."""
    depths = accumulate(_BRACKETS.get(char, 0) for char in text)
    outside = [at for at, depth in enumerate(depths) if depth == 0 and text[at] == sign]
    return [text[begin + 1 : end] for begin, end in pairwise((-1, *outside, len(text)))]
