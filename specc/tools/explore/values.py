"""Numbers for values, so that configurations are small and quick to compare."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from typing import Any, TypeVar

from specc.lang.evaluate import range_of
from specc.model import expr as m
from specc.model.types import Int, Type
from specc.tools.explore.partial import (
    SOME,
    AbstractValue,
    KnownValues,
    is_larger_than,
    is_literal,
    is_some,
)
from specc.tools.explore.regions import NumberDomain, Region, bounded_unknown, is_number

MOST_VALUES = 32
"""The most tracked values of one element; of later ones only the region is known."""
MOST_ON_RAMP = 500
"""The most of a number between the constants that it is given."""
MOST_PARTS = 500
"""The most parts of a tracked value, since a list may grow in every period."""
MOST_OPTIONS, MOST_COMBINED = 16, 256
"""The most branches of a period from one value with a known region, and from all."""

MOST_RANGES = 4
"""The most ranges of unknown values of one output, since in a cycle they may grow for ever."""

_ANY_NUMBER = NumberDomain()
"""The domain of a number that nothing is compared with."""

UNKNOWN, ABSENT, PRESENT = 0, 1, 2
"""Numbers of an unknown value, an absent one, and SOME; others stand for known values."""
Target = TypeVar("Target")


class Interner(dict[Any, int]):
    """Assigns numbers to items in the order of their first use."""

    def __init__(self) -> None:
        self.by_number: list[Any] = []

    def number(self, item: Any) -> int:
        """The number of an item; `self[item]` is quicker for a known one."""
        return self[item]

    def __missing__(self, item: Any) -> int:
        number = self[item] = len(self.by_number)
        self.by_number.append(item)
        return number


class ValueTable:
    """Numbers of the tracked values, shared by all machines."""

    def __init__(self, max_values: int | None, domains: Mapping[str, NumberDomain]) -> None:
        """At most `max_values` of each target are tracked, and of one that counts none.

        None: all between its cuts, and many between the constants that it is given.
        """
        self._max_values = max_values
        self._domains = domains
        self._interner = Interner()
        for reserved in ("unknown", "absent", SOME):  # as `UNKNOWN`, `ABSENT`, `PRESENT`
            self._interner.number(reserved)
        self._tracked: dict[str, set[int]] = {}
        self._ranges: dict[str, set[int]] = {}
        self.has_reals = False
        """Whether some of these are real numbers, which may have new values for ever."""
        self.widened: set[str] = set()
        """Targets whose region is not enough for a decision."""

    def number_of(self, target: str, expr: m.Expr, known: KnownValues) -> int:
        """The number of the value that is assigned to a target, before any region is involved."""
        (number,) = self.possible_numbers(target, expr, known, is_first=True)
        return number

    def number_of_literal(self, expr: m.Expr) -> int:
        """The number of a literal, whatever the bounds are."""
        return self._interner.number(expr)

    def possible_numbers(
        self,
        target: str,
        expr: m.Expr,
        known: KnownValues,
        *,
        sent: Type | None = None,
        is_first: bool = False,
    ) -> tuple[int, ...]:
        """The numbers of the values that may be assigned to a target.

        What it gets at the start, where no region is known, is always tracked.

        An unknown value that is sent, with the type `sent`, keeps its bounds; those of memory hold
        at all times (`MemoryBounds`).
        """
        if is_literal(expr):
            number = self._interner.number(expr)
            if is_first or self._is_tracked(target, number, expr):
                return (number,)
            if isinstance(expr, m.Number):
                return self._region_numbers(target, expr, expr.value, expr.value)
            self.widened.add(target)
            return (UNKNOWN if isinstance(expr, m.Nothing) else PRESENT,)
        if known.reads_region(expr):
            if is_number(expr):
                return self._region_numbers(target, expr, *range_of(expr, known.range_of))
            self.widened.add(target)
        elif sent and (found := bounded_unknown(expr, range_of(expr, known.range_of), sent)):
            number = self._interner.number(found)
            ranges = self._ranges.setdefault(target, set())
            if number in ranges or len(ranges) < MOST_RANGES:
                ranges.add(number)
                return (number,)
        return (PRESENT if is_some(expr, known) else UNKNOWN,)

    def _is_tracked(self, target: str, number: int, value: m.Expr) -> bool:
        """Whether a value of a target is tracked, from now on if the bounds allow."""
        seen = self._tracked.setdefault(target, set())
        if number in seen:
            return True
        domain = self._domains.get(target, _ANY_NUMBER)
        if self._max_values is not None:
            allowed = not domain.counts and len(seen) < self._max_values
        else:
            is_decisive = not isinstance(value, m.Number) or domain.is_decisive(value.value)
            on_ramp = isinstance(value, m.Number) and domain.is_between_given(value.value)
            allowed = is_decisive or len(seen) < (MOST_ON_RAMP if on_ramp else MOST_VALUES)
        if allowed and not is_larger_than(value, MOST_PARTS):
            seen.add(number)
            return True
        return False

    def _region_numbers(
        self, target: str, expr: m.Expr, low: float, high: float
    ) -> tuple[int, ...]:
        """The numbers of the regions of a range."""
        whole = isinstance(expr.type, Int)
        self.has_reals |= not whole
        domain = self._domains.get(target, _ANY_NUMBER)
        regions = list(domain.regions_within(low, high, whole=whole))
        if len(regions) > 1:
            self.widened.add(target)
        if len(regions) > MOST_OPTIONS:
            return (PRESENT,)
        return tuple(self._interner.number(_region_value(region, expr)) for region in regions)

    def value(self, number: int) -> AbstractValue | None:
        """The value that a number stands for; None if it is unknown or absent."""
        return None if number in (UNKNOWN, ABSENT) else self._interner.by_number[number]


def limit_combinations(options: Mapping[Target, tuple[int, ...]]) -> dict[Target, tuple[int, ...]]:
    """The options of several targets; with too many together, the widest become unknown."""
    limited = dict(options)
    while prod(map(len, limited.values())) > MOST_COMBINED:
        widest = max(limited, key=lambda target: len(limited[target]))
        limited[widest] = (PRESENT,)
    return limited


def _region_value(region: Region, expr: m.Expr) -> AbstractValue:
    low, high = region
    if low != high or (low == 0 and not isinstance(expr.type, Int)):  # 0.0 or -0.0
        return region
    return m.Number(int(low) if isinstance(expr.type, Int) else low, type=expr.type)
