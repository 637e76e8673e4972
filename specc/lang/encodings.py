"""What the solver has for functions of the language: terms, or laws of a result that is unknown."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from specc.lang.row import SolverTerms


def least(of: SolverTerms, *args: Any) -> Any:
    """`min(a, b, ...)`."""
    first, *rest = args
    for other in rest:
        first = of.choice(first < other, first, other)
    return first


def greatest(of: SolverTerms, *args: Any) -> Any:
    """`max(a, b, ...)`."""
    first, *rest = args
    for other in rest:
        first = of.choice(first > other, first, other)
    return first


def clamped(of: SolverTerms, a: Any, low: Any, high: Any) -> Any:
    """`clamp(a, low, high)`."""
    return least(of, greatest(of, a, low), high)


def sign(of: SolverTerms, a: Any) -> Any:
    """`sign(a)`."""
    return of.choice(a > 0, of.whole(1), of.choice(a < 0, of.whole(-1), of.whole(0)))


def floor(of: SolverTerms, a: Any) -> Any:
    """`floor(a)`."""
    return of.floor(a)


def rounded(of: SolverTerms, a: Any) -> Any:
    """`round(a)`."""
    above = a + of.constant(0.5)
    whole = of.floor(above)
    return of.choice(whole == above, whole - whole % 2, whole)  # a tie goes to what is even


def wrapped(of: SolverTerms, a: Any) -> Any:
    """`wrap_angle(a)`, of which both the argument and the result are floats."""
    turn = of.constant(math.tau)
    return of.representable(a - turn * of.floor((a + of.constant(math.pi)) / turn))


def diagonal(of: SolverTerms, result: Any, *args: Any) -> Iterator[Any]:
    """`hypot(a, b)`: not less than either, nor more than both; libraries err by less than an ulp.

    What is too large is a number that is larger than all others.
    """
    a, b = (of.choice(arg > -arg, arg, -arg) for arg in args)
    yield result >= a
    yield result >= b
    most = (a + b) * of.constant(1 + Fraction(1, 2**52)) + of.constant(Fraction(1, 2**1074))
    yield of.choice(most < of.constant(sys.float_info.max), result <= most, result >= a)
