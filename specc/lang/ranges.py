"""Ranges: the least and greatest values of floats, from those of what they are computed from.

Rounding keeps order, so that the bounds of operands give those of the result. A truth value is a
number here, false before true.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable
from fractions import Fraction

Range = tuple[float, float]
Operation = Callable[..., Range]

_LARGEST = sys.float_info.max
ANY: Range = (-math.inf, math.inf)
"""What is not known, or fails in some cases."""
NOT_NEGATIVE: Range = (0, math.inf)
"""Of whole numbers, too: sums of them are not rounded."""
DIRECTIONS: Range = (-math.pi, math.nextafter(math.pi, 0.0))
"""The least and greatest float in [-pi, pi)."""
HALF_TURNS: Range = (-math.nextafter(math.pi, 4.0), math.nextafter(math.pi, 4.0))
"""Half a turn in both directions, to one of the two floats that are next to it."""


def as_floats(a: Range) -> Range:
    """The range of the floats to which whole numbers in a range are converted."""
    low, high = _within_floats(a)
    return float(low), float(high)


def as_integers(a: Range) -> Range:
    """The range with integers as its ends, whose sums are exact."""
    low, high = (end if math.isinf(end) else int(end) for end in _within_floats(a))
    return low, high


def _within_floats(a: Range) -> Range:
    """Limit the ends of a range to those of floats, or infinity."""
    low, high = a
    return (
        -math.inf if low < -_LARGEST else min(low, _LARGEST),
        math.inf if high > _LARGEST else max(high, -_LARGEST),
    )


def range_of_value(value: float) -> Range:
    """The range that contains one number only."""
    return _within_floats((value, value))


def apply(operation: Operation, parts: Iterable[Range]) -> Range:
    """Apply an operation to ranges; any number is possible where it fails."""
    try:
        low, high = operation(*parts)
        return ANY if math.isnan(low) or math.isnan(high) else _within_floats((low, high))
    except (ArithmeticError, ValueError, TypeError):
        return ANY


def intersection(a: Range, b: Range) -> Range:
    """The intersection of two ranges."""
    return max(a[0], b[0]), min(a[1], b[1])


def union(*of: Range) -> Range:
    """The smallest range that contains all of these."""
    return least(*of)[0], greatest(*of)[1]


def identity(a: Range) -> Range:
    """`a`."""
    return a


def _hull(*ends: float) -> Range:
    return ANY if any(map(math.isnan, ends)) else (min(ends), max(ends))


def negative(a: Range) -> Range:
    """`-a`."""
    return -a[1], -a[0]


def sum_of(a: Range, b: Range) -> Range:
    """`a + b`."""
    return _hull(a[0] + b[0], a[1] + b[1])


def product(a: Range, b: Range) -> Range:
    """`a * b`."""
    return _hull(*(x * y for x in a for y in b))


def quotient(a: Range, b: Range) -> Range:
    """`a / b`."""
    return ANY if b[0] <= 0 <= b[1] else _hull(*(x / y for x in a for y in b))


def absolute(a: Range) -> Range:
    """`abs(a)`."""
    low, high = a
    return _hull(abs(low), abs(high)) if low > 0 or high < 0 else (0, max(-low, high))


def power(a: Range, b: Range) -> Range:
    """`a ** b`; libraries round powers to one of the two floats that are next to them."""
    exponent = b[0]
    if b[0] != b[1] or (a[0] <= 0 and (exponent < 0 or exponent != int(exponent))):
        return ANY
    ends = [_powers(x, exponent) for x in (absolute(a) if exponent % 2 == 0 else a)]
    return _hull(*(end for pair in ends for end in pair))


def _powers(base: float, exponent: float) -> Range:
    found = base**exponent
    if not math.isfinite(base) or not math.isfinite(found):
        return found, found
    if exponent == int(exponent) and Fraction(found) == Fraction(base) ** int(exponent):
        return found, found
    return math.nextafter(found, -math.inf), math.nextafter(found, math.inf)


def _less(a: Range, b: Range) -> Range:
    return a[1] < b[0], a[0] < b[1]


def _at_most(a: Range, b: Range) -> Range:
    return a[1] <= b[0], a[0] <= b[1]


def _equal(a: Range, b: Range) -> Range:
    return a[0] == a[1] == b[0] == b[1], a[0] <= b[1] and b[0] <= a[1]


def _not(a: Range) -> Range:
    return a[1] <= 0, a[0] <= 0  # of what is not known, too


def choice(test: Range, then: Range, otherwise: Range) -> Range:
    """`then if test else otherwise`."""
    if test[0] == test[1]:
        return then if test[0] else otherwise
    return _hull(*then, *otherwise)


def least(*of: Range) -> Range:
    """`min(a, b, ...)`."""
    return min(low for low, _ in of), min(high for _, high in of)


def greatest(*of: Range) -> Range:
    """`max(a, b, ...)`."""
    return max(low for low, _ in of), max(high for _, high in of)


def difference(a: Range, b: Range) -> Range:
    """`a - b`."""
    return _hull(a[0] - b[1], a[1] - b[0])


def near(a: Range, b: Range, limit: Range) -> Range:
    """`near(a, b, limit)`, of numbers."""
    return _at_most(absolute(difference(a, b)), limit)


CONDITIONS: dict[str, Operation] = {
    "<": _less,
    "<=": _at_most,
    ">": lambda a, b: _less(b, a),
    ">=": lambda a, b: _at_most(b, a),
    "==": _equal,
    "!=": lambda a, b: _not(_equal(a, b)),
    "not": _not,
    "and": least,
    "or": greatest,
}
"""By the sign or word of a condition."""
