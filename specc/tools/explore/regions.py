"""Interval abstraction: numbers with a known region between two constants.

A counter has too many values to track each. Decisions depend on comparisons with constants, so all
values between two neighbouring constants form one region.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
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


class Regions:
    """The number line, cut at some constants."""

    def __init__(self, cuts: Iterable[float]) -> None:
        self.cuts = sorted(set(cuts))

    def intersecting(self, low: float, high: float, *, whole: bool) -> Iterator[Region]:
        """The regions that intersect a range, of integers if `whole`."""
        at = bisect_left(self.cuts, low)
        before = self.cuts[at - 1] if at else -math.inf
        for cut in (*self.cuts[at:], math.inf):
            inside = _open_interval(before, cut, whole=whole)
            if inside.low <= inside.high and max(low, inside.low) <= min(high, inside.high):
                yield inside
            if cut > high:
                return
            if low <= cut < math.inf and not (whole and cut != int(cut)):
                yield Region(cut, cut)
            before = cut

    def is_within(self, number: float) -> bool:
        """Whether a number lies between zero and one of the cuts."""
        return min([0, *self.cuts[:1]]) <= number <= max([0, *self.cuts[-1:]])


def _open_interval(low: float, high: float, *, whole: bool) -> Region:
    """The open interval between two numbers."""
    if not whole:
        return Region(math.nextafter(low, math.inf), math.nextafter(high, -math.inf))
    least = low if math.isinf(low) else math.floor(low) + 1
    return Region(least, high if math.isinf(high) else math.ceil(high) - 1)


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
