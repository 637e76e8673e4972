"""Lines: all values of a number that changes by a constant, again and again, at once."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

from specc.lang.ranges import Range
from specc.lang.signs import SIGNS
from specc.model import expr as m
from specc.model.types import Int

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

    def meets_zero(self, times: int) -> bool:
        """Whether one of its first `times` values is zero."""
        if not self.slope:
            return not self.base
        turns = -self.base / self.slope
        return turns.denominator == 1 and 0 <= turns < times


def lined(expr: m.Expr, known: Callable[[m.Expr], Line | None], times: int) -> Line | None:
    """The line of a sum, difference or multiple of lines; None if some value may round.

    `known` gives that of leaves; the values are the first `times` of each line.
    """
    found = None
    match expr:
        case m.Number(value=value):
            found = Line(Fraction(value), Fraction(0))
        case m.Unary(op="-", operand=operand):
            one = lined(operand, known, times)
            found = one and Line(-one.base, -one.slope)
        case m.Binary(op=word, left=left, right=right):
            a, b = lined(left, known, times), lined(right, known, times)
            found = None if a is None or b is None else _combined(word, a, b)
        case _:
            found = known(expr)
    if found is None or not found.is_exact(times):
        return None
    return None if _may_lose_sign(expr) and found.meets_zero(times) else found


def _may_lose_sign(expr: m.Expr) -> bool:
    """Whether it may be -0.0, which no line has: a sum of others is 0.0."""
    is_turned = isinstance(expr, m.Unary) or (isinstance(expr, m.Binary) and expr.op == "*")
    return is_turned and not isinstance(expr.type, Int)


def _combined(word: str, a: Line, b: Line) -> Line | None:
    sign = SIGNS[word]
    if sign.binds != "sum" and not (sign.commutes and 0 in (a.slope, b.slope)):
        return None
    base = sign.value(a.base, b.base)
    return Line(base, sign.value(a.at(1), b.at(1)) - base)
