"""Numbers that stand for kept values, so that configurations are small and quick to compare."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from fractions import Fraction
from math import prod
from typing import Any, TypeVar

from specc.lang.bounds import bounded
from specc.model import expr as m
from specc.model.types import Int, Type
from specc.tools.explore.partial import (
    SOME,
    AbstractValue,
    Known,
    has_more,
    is_known,
    is_literal,
    is_some,
)
from specc.tools.explore.regions import Region, Regions, is_number, within

MOST_VALUES = 32
"""Values that are followed of one element; of later ones only the region is known."""
MOST_PARTS = 500
"""Parts of a value that is followed: a list may grow in every period."""
MOST_OPTIONS, MOST_COMBINED = 16, 256
"""Branches of a period that come from one value of which only the region is known, and from all."""

MOST_RANGES = 4
"""Ranges of unknown values that are followed of one output; in a circle they may grow for ever."""

UNKNOWN, ABSENT, PRESENT = 0, 1, 2
"""Numbers of an unknown value, an absent one, and SOME; others stand for what is known."""
Target = TypeVar("Target")


class Numbers(dict[Any, int]):
    """Numbers things in the order in which they are first met."""

    def __init__(self) -> None:
        self.things: list[Any] = []

    def of(self, thing: Any) -> int:
        """The number of a thing, as `self[thing]`, which calls nothing for a known one."""
        return self[thing]

    def __missing__(self, thing: Any) -> int:
        number = self[thing] = len(self.things)
        self.things.append(thing)
        return number


class ValueNumbers:
    """Numbers of the values that are kept, shared by all machines."""

    def __init__(self, most: int | None, cuts: Iterable[float] = ()) -> None:
        """At most `most` values of each target are followed; None: all between the `cuts`."""
        self._most = most
        self._regions = Regions(cuts)
        self._numbers = Numbers()
        for reserved in ("unknown", "absent", SOME):  # as `UNKNOWN`, `ABSENT`, `PRESENT`
            self._numbers.of(reserved)
        self._seen: dict[str, set[int]] = {}
        self._ranges: dict[str, set[int]] = {}
        self.has_reals = False
        """Whether some of these are real numbers, which may have new values for ever."""
        self.widened: set[str] = set()
        """Targets whose region is not enough for a decision."""

    def of(self, target: str, expr: m.Expr, known: Known) -> int:
        """The number of the value that is assigned to a target, before any region is involved."""
        (number, *_) = self.options(target, expr, known)
        return number

    def options(
        self, target: str, expr: m.Expr, known: Known, *, sent: Type | None = None
    ) -> tuple[int, ...]:
        """The numbers of the values that may be assigned to a target.

        Of an unknown one that is sent, as a value of this type, it is kept what it lies within; of
        memory `MemoryBounds` knows it for all times.
        """
        if is_literal(expr):
            number = self._numbers.of(expr)
            if self.follows(target, number):
                return (number,)
            if isinstance(expr, m.Number):
                return self._in(target, expr, expr.value, expr.value)
            self.widened.add(target)
            return (UNKNOWN if isinstance(expr, m.Nothing) else PRESENT,)
        if known.is_unclear(expr):
            if is_number(expr):
                return self._in(target, expr, *bounded(expr, known.range_of))
            self.widened.add(target)
        elif sent and (found := within(expr, bounded(expr, known.range_of), sent)):
            number = self._numbers.of(found)
            ranges = self._ranges.setdefault(target, set())
            if number in ranges or len(ranges) < MOST_RANGES:
                ranges.add(number)
                return (number,)
        return (PRESENT if is_some(expr, known) else UNKNOWN,)

    def follows(self, target: str, number: int) -> bool:
        """Whether a number that a target comes to have is followed; it is from then on."""
        seen, value = self._seen.setdefault(target, set()), self.value(number)
        if is_known(value) and number not in seen:
            if self._is_left(seen, value):
                return False
            seen.add(number)
        return True

    def moved(self, number: int, by: Fraction) -> int:
        """The number of a value to which something is added, exactly."""
        value = self.value(number)
        if not by or not isinstance(value, m.Number):
            return number
        there = Fraction(value.value) + by
        whole = isinstance(value.value, int)
        return self._numbers.of(replace(value, value=int(there) if whole else float(there)))

    def _is_left(self, seen: set[int], expr: m.Expr) -> bool:
        """Whether a value is beyond the bound on values that are followed."""
        if has_more(expr, MOST_PARTS):
            return True
        if len(seen) < MOST_VALUES:
            return False
        is_among = not isinstance(expr, m.Number) or self._regions.is_within(expr.value)
        return self._most is not None or not is_among

    def _in(self, target: str, expr: m.Expr, low: float, high: float) -> tuple[int, ...]:
        """The numbers of the regions of a range."""
        whole = isinstance(expr.type, Int)
        self.has_reals |= not whole
        regions = list(self._regions.between(low, high, whole=whole))
        if len(regions) > 1:
            self.widened.add(target)
        if len(regions) > MOST_OPTIONS:
            return (PRESENT,)
        return tuple(self._numbers.of(_shown(region, expr)) for region in regions)

    def value(self, number: int) -> AbstractValue | None:
        """The value that a number stands for; None if it is unknown or absent."""
        return None if number in (UNKNOWN, ABSENT) else self._numbers.things[number]


def combinable(options: Mapping[Target, tuple[int, ...]]) -> dict[Target, tuple[int, ...]]:
    """The options of several targets, where there are too many together without the widest."""
    left = dict(options)
    while prod(map(len, left.values())) > MOST_COMBINED:
        widest = max(left, key=lambda target: len(left[target]))
        left[widest] = (PRESENT,)
    return left


def _shown(region: Region, expr: m.Expr) -> AbstractValue:
    low, high = region
    if low != high or (low == 0 and not isinstance(expr.type, Int)):  # 0.0 or -0.0
        return region
    return m.Number(int(low) if isinstance(expr.type, Int) else low, type=expr.type)
