"""Least and greatest values of floats: rounding keeps order, so that bounds of operands give them.

A truth value is a number here, false before true.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

Range = tuple[float, float]
Operation = Callable[..., Range]

ANY: Range = (-math.inf, math.inf)
"""What is not known, or fails in some cases."""


def _spanned(*ends: float) -> Range:
    return ANY if any(map(math.isnan, ends)) else (min(ends), max(ends))


def _product(a: Range, b: Range) -> Range:
    return _spanned(*(x * y for x in a for y in b))


def _quotient(a: Range, b: Range) -> Range:
    return ANY if b[0] <= 0 <= b[1] else _spanned(*(x / y for x in a for y in b))


def _absolute(a: Range) -> Range:
    low, high = a
    return _spanned(abs(low), abs(high)) if low > 0 or high < 0 else (0, max(-low, high))


def _root(a: Range) -> Range:
    return (math.sqrt(a[0]), math.sqrt(a[1])) if a[0] >= 0 else ANY


def _power(a: Range, b: Range) -> Range:
    """Libraries round powers to one of the two floats that are next to them."""
    exponent = b[0]
    if b[0] != b[1] or (a[0] <= 0 and (exponent < 0 or exponent != int(exponent))):
        return ANY
    ends = [_powers(x, exponent) for x in (_absolute(a) if exponent % 2 == 0 else a)]
    return _spanned(*(end for pair in ends for end in pair))


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
    return not a[1], not a[0]


def _choice(test: Range, then: Range, otherwise: Range) -> Range:
    if test[0] == test[1]:
        return then if test[0] else otherwise
    return _spanned(*then, *otherwise)


def _least(*of: Range) -> Range:
    return min(low for low, _ in of), min(high for _, high in of)


def _greatest(*of: Range) -> Range:
    return max(low for low, _ in of), max(high for _, high in of)


def _difference(a: Range, b: Range) -> Range:
    return _spanned(a[0] - b[1], a[1] - b[0])


OPERATIONS: dict[str, Operation] = {
    "+": lambda a, b: _spanned(a[0] + b[0], a[1] + b[1]),
    "-": lambda a, b=None: (-a[1], -a[0]) if b is None else _difference(a, b),
    "*": _product,
    "/": _quotient,
    "**": _power,
    "abs": _absolute,
    "sqrt": _root,
    "min": _least,
    "max": _greatest,
    "near": lambda a, b, limit: _at_most(_absolute(_difference(a, b)), limit),
    "<": _less,
    "<=": _at_most,
    ">": lambda a, b: _less(b, a),
    ">=": lambda a, b: _at_most(b, a),
    "==": _equal,
    "!=": lambda a, b: _not(_equal(a, b)),
    "not": _not,
    "and": _least,
    "or": _greatest,
    "choice": _choice,
}
"""By the sign or name of what the language computes with numbers and truth values."""
