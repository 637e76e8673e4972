"""Operators on numbers, vectors and poses: all that is known of each by its sign."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from operator import add, mul, sub, truediv
from typing import Any, Literal

from specc.lang import ranges
from specc.lang.ranges import Operation
from specc.lang.values import compose, elementwise, inverse, transform_point

_MOST_BITS = 1 << 16
"""Of a whole number; a run could hold larger ones, no design needs them."""


Inverse = Callable[[Any, Any], Any]
"""From the wanted result and the other side; None if there is no such value."""


@dataclass(frozen=True, slots=True)
class Sign:
    """An operator between two values."""

    binds: Literal["sum", "product", "power"]
    """How tightly it binds its operands."""
    value: Callable[[Any, Any], Any]
    """What it computes on plain Python values, and on terms of the solver but for a division of
    whole numbers. Raises OverflowError for whole numbers that no design needs."""
    inverse: tuple[Inverse | None, Inverse | None]
    """What the left side, and the right one, may be so that the result is a wanted one."""
    range: Operation | None = None
    """The least and greatest value of the result by those of the operands."""
    commutes: bool = False
    may_fail: bool = False
    """Whether it raises for some numbers, so that it is computed only where it is needed."""
    propagates: int = 2
    """In how many operands, from the left, a number that is not finite makes the result so."""


def _apply_pose(X: Any, to: Any) -> Any:
    return compose(X, to) if _is_pose(to) else transform_point(X, to)


def _is_pose(value: Any) -> bool:
    return isinstance(value[0], tuple)


def _factor_before(value: Any, X: Any) -> Any:
    return compose(value, inverse(X)) if _is_pose(value) else None


def _times(a: Any, b: Any) -> Any:
    return _is_bounded(a, b, 1) and a * b


def _power(a: Any, b: Any) -> Any:
    return _is_bounded(a, a, abs(b)) and a**b


def _is_bounded(a: Any, b: Any, times: int) -> bool:
    whole = isinstance(a, int) and isinstance(b, int)
    if whole and max(a.bit_length(), b.bit_length()) * (times + 1) > _MOST_BITS:
        raise OverflowError("the result is too large")
    return True


def _subtrahend(value: Any, left: Any) -> Any:
    return elementwise(sub, left, value)


def _divided(value: Any, by: Any) -> Any:
    return elementwise(truediv, value, by) if _is_number(by) and by else None


def _dividend(value: Any, by: Any) -> Any:
    return elementwise(mul, value, by) if _is_number(by) else None


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


_added, _subtracted = partial(elementwise, add), partial(elementwise, sub)
_multiplied = partial(elementwise, _times)

SIGNS = {
    "+": Sign("sum", _added, (_subtracted, _subtracted), ranges.sum_of, commutes=True),
    "-": Sign("sum", _subtracted, (_added, _subtrahend), ranges.difference),
    "*": Sign("product", _multiplied, (_divided, _divided), ranges.product, commutes=True),
    "/": Sign(
        "product",
        partial(elementwise, truediv),
        (_dividend, None),
        ranges.quotient,
        may_fail=True,
        propagates=1,
    ),
    "**": Sign("power", _power, (None, None), ranges.power, may_fail=True, propagates=1),
    "@": Sign(
        "product", _apply_pose, (_factor_before, lambda value, X: _apply_pose(inverse(X), value))
    ),
}
