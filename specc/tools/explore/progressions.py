"""Arithmetic progressions: all values of a number that changes by a constant each time."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

from specc.lang.ranges import Range
from specc.lang.values import SIGNS
from specc.model import expr as m
from specc.model.types import Int, Type

MAX_EXACT = 2**53
"""Up to it integers equal floats; beyond it, integers and reals differ."""


class Progression(NamedTuple):
    """A number that changes by a constant: its first value, and what is added each time."""

    base: Fraction
    step: Fraction

    def value_at(self, number: int) -> Fraction:
        """The value after so many changes."""
        return self.base + number * self.step

    def range_over(self, times: int, *, whole: bool = False) -> Range:
        """The least and greatest of its first `times` values, integers if `whole`."""
        low, high = sorted((self.base, self.value_at(times - 1)))
        return (int(low), int(high)) if whole else (float(low), float(high))

    def is_exact(self, times: int) -> bool:
        """Whether runs represent its first `times` values, which are on one grid of floats."""
        grid = max(self.base.denominator, self.step.denominator)
        most = max(abs(self.base), abs(self.value_at(times - 1)))
        return most * grid <= MAX_EXACT and 1 / grid > 0.0

    def is_negative_at_zeros_of(self, other: Progression, times: int) -> bool:
        """Whether it is negative at one of the first `times` values where the other one is zero."""
        if not other.step:
            return not other.base and self.range_over(times)[0] < 0
        turns = -other.base / other.step
        return turns.denominator == 1 and 0 <= turns < times and self.value_at(int(turns)) < 0


def progression_of(
    expr: m.Expr, known: Callable[[m.Expr], Progression | None], times: int
) -> Progression | None:
    """The progression of a sum, difference or multiple; None if some value may round, or is -0.0.

    `known` gives those of leaves; the values are the first `times` of each progression.
    """
    found = None
    match expr:
        case m.Number(value=value):
            found = None if is_minus_zero(value) else Progression(Fraction(value), Fraction(0))
        case m.Unary(op="-", operand=operand):
            one = progression_of(operand, known, times)
            found = one and _multiple(Progression(Fraction(-1), Fraction(0)), one, times, expr.type)
        case m.Binary(op=word, left=left, right=right):
            a, b = progression_of(left, known, times), progression_of(right, known, times)
            found = None if a is None or b is None else _combine(word, a, b, times, expr.type)
        case _:
            found = known(expr)
    return found if found and found.is_exact(times) else None


def is_minus_zero(value: float) -> bool:
    """Whether it is -0.0, which equals 0.0 and is another angle for `atan2`."""
    return value == 0 and math.copysign(1.0, value) < 0


def _combine(
    word: str, a: Progression, b: Progression, times: int, type_: Type
) -> Progression | None:
    sign = SIGNS[word]
    if sign.binds == "sum":  # of zeros without a sign it has none
        base = sign.value(a.base, b.base)
        return Progression(base, sign.value(a.value_at(1), b.value_at(1)) - base)
    return _multiple(a, b, times, type_) if sign.commutes else None


def _multiple(a: Progression, b: Progression, times: int, type_: Type) -> Progression | None:
    """The multiple of a progression; None if it is -0.0 at some time, as integers are not."""
    if a.step and b.step:
        return None
    if not isinstance(type_, Int) and (
        a.is_negative_at_zeros_of(b, times) or b.is_negative_at_zeros_of(a, times)
    ):
        return None
    return Progression(a.base * b.base, a.step * b.base + b.step * a.base)
