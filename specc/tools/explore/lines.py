"""Lines: all values of a number that changes by a constant, again and again, at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

from specc.lang.ranges import Range
from specc.lang.signs import SIGNS
from specc.model import expr as m
from specc.model.types import Int, Type

EXACT = 2**53
"""Up to it integers equal floats; beyond, it matters which of the two a real is in a run."""


class Line(NamedTuple):
    """A number that changes by a constant: its first value, and what is added each time."""

    base: Fraction
    slope: Fraction

    def at(self, number: int) -> Fraction:
        """The value after so many changes."""
        return self.base + number * self.slope

    def over(self, times: int, *, whole: bool = False) -> Range:
        """The least and greatest of its first `times` values, integers if `whole`."""
        low, high = sorted((self.base, self.at(times - 1)))
        return (int(low), int(high)) if whole else (float(low), float(high))

    def is_exact(self, times: int) -> bool:
        """Whether runs represent its first `times` values, which are on one grid of floats."""
        grid = max(self.base.denominator, self.slope.denominator)
        most = max(abs(self.base), abs(self.at(times - 1)))
        return most * grid <= EXACT and 1 / grid > 0.0

    def is_negative_at_zeros_of(self, other: Line, times: int) -> bool:
        """Whether it is negative at one of the first `times` values where the other one is zero."""
        if not other.slope:
            return not other.base and self.over(times)[0] < 0
        turns = -other.base / other.slope
        return turns.denominator == 1 and 0 <= turns < times and self.at(int(turns)) < 0


def lined(expr: m.Expr, known: Callable[[m.Expr], Line | None], times: int) -> Line | None:
    """The line of a sum, difference or multiple of lines; None if some value may round, or is -0.0.

    `known` gives that of leaves; the values are the first `times` of each line.
    """
    found = None
    match expr:
        case m.Number(value=value):
            found = None if is_minus_zero(value) else Line(Fraction(value), Fraction(0))
        case m.Unary(op="-", operand=operand):
            one = lined(operand, known, times)
            found = one and _product(Line(Fraction(-1), Fraction(0)), one, times, expr.type)
        case m.Binary(op=word, left=left, right=right):
            a, b = lined(left, known, times), lined(right, known, times)
            found = None if a is None or b is None else _combined(word, a, b, times, expr.type)
        case _:
            found = known(expr)
    return found if found and found.is_exact(times) else None


def is_minus_zero(value: float) -> bool:
    """Whether it is -0.0, which equals 0.0 and is another angle for `atan2`."""
    return value == 0 and math.copysign(1.0, value) < 0


def _combined(word: str, a: Line, b: Line, times: int, type_: Type) -> Line | None:
    sign = SIGNS[word]
    if sign.binds == "sum":  # of zeros without a sign it has none
        base = sign.value(a.base, b.base)
        return Line(base, sign.value(a.at(1), b.at(1)) - base)
    return _product(a, b, times, type_) if sign.commutes else None


def _product(a: Line, b: Line, times: int, type_: Type) -> Line | None:
    """The multiple of a line; None if it is -0.0 at some time, as integers are not."""
    if a.slope and b.slope:
        return None
    if not isinstance(type_, Int) and (
        a.is_negative_at_zeros_of(b, times) or b.is_negative_at_zeros_of(a, times)
    ):
        return None
    return Line(a.base * b.base, a.slope * b.base + b.slope * a.base)
