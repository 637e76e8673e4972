"""Interval abstraction: numbers with a known region between two constants.

A counter has too many values to track each. Decisions depend on comparisons with constants, so all
values between two neighbouring cuts form one region.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from specc.lang.kinds import kind
from specc.lang.ranges import ANY, Range, as_floats
from specc.model import expr as m
from specc.model.types import Int, Real, Type, Vector


class Region(NamedTuple):
    """The numbers from `low` to `high`, both included."""

    low: float
    high: float


@dataclass(frozen=True, slots=True)
class BoundedUnknown:
    """An unknown number, or vector of numbers, between two numbers whatever is measured."""

    low: float
    high: float


def bounded_unknown(expr: m.Expr, range_: Range, type_: Type) -> BoundedUnknown | None:
    """The bounds of a number that an expression of a known range gives.

    An integer that becomes a real may be rounded.
    """
    of = _element(expr.type)
    if range_ == ANY or kind(of).sort not in ("whole", "real"):
        return None
    return BoundedUnknown(*(as_floats(range_) if of != _element(type_) else range_))


def _element(type_: Type) -> Type:
    return type_.element if isinstance(type_, Vector) else type_


class Cut(NamedTuple):
    """A place where the number line is cut: just below a value, or just above it."""

    value: float
    is_above: bool

    def __neg__(self) -> Cut:
        """The cut of the negative number."""
        return Cut(-self.value, not self.is_above)

    def neighbours(self, *, whole: bool) -> tuple[float, float]:
        """The last number before the cut, and the first one after it; integers if `whole`."""
        value = self.value
        if math.isinf(value):
            return value, value
        if whole:
            first = math.floor(value) + 1 if self.is_above else math.ceil(value)
            return first - 1, first
        if self.is_above:
            return value, math.nextafter(value, math.inf)
        return math.nextafter(value, -math.inf), value


class Regions:
    """The number line, cut at some places."""

    def __init__(self, cuts: Iterable[Cut] = ()) -> None:
        self.cuts = sorted(set(cuts))

    def intersecting(self, low: float, high: float, *, whole: bool) -> Iterator[Region]:
        """The regions that intersect a range, of integers if `whole`."""
        begin = -math.inf
        for cut in self.cuts:
            last, first = cut.neighbours(whole=whole)
            if max(low, begin) <= min(high, last):
                yield Region(begin, last)
            begin = first
        if max(low, begin) <= high:
            yield Region(begin, math.inf)


@dataclass(frozen=True, slots=True)
class NumberDomain:
    """The abstract values of one number: its regions, within its proven bounds.

    If it `counts`, only its region is tracked, unless every value is wanted.
    """

    regions: Regions = field(default_factory=Regions)
    low: float = -math.inf
    high: float = math.inf
    counts: bool = False
    given: tuple[float, float] = (0, 0)
    """The least and the greatest of zero and the constants that it is given, or computed from."""

    def regions_within(self, low: float, high: float, *, whole: bool) -> Iterator[Region]:
        """The regions, within the proven bounds, that intersect a range."""
        for region in self.regions.intersecting(low, high, whole=whole):
            yield Region(max(region.low, self.low), min(region.high, self.high))

    def is_decisive(self, number: float) -> bool:
        """Whether a number lies between its proven bounds, zero and its cuts."""
        ends = [0, *(cut.value for cut in self.regions.cuts), self.low, self.high]
        finite = [end for end in ends if math.isfinite(end)]
        return min(finite) <= number <= max(finite)

    def is_between_given(self, number: float) -> bool:
        """Whether a number lies between the constants that come to it, as on a ramp."""
        return self.given[0] <= number <= self.given[1]


def is_number(expr: m.Expr) -> bool:
    """Whether the values of an expression are single numbers."""
    return isinstance(expr.type, (Int, Real))


def value_leaves(expr: m.Expr) -> Iterator[m.Input | m.MemoryRef]:
    """The inputs and memory that determine the value of an expression.

    Arguments of operators are left out: the result is unknown anyway.
    """
    if isinstance(expr, (m.Input, m.MemoryRef)):
        yield expr
    elif not isinstance(expr, (m.Call, m.Fresh, m.Present, m.Lag)):
        for part in m.children(expr):
            yield from value_leaves(part)
