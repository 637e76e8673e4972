"""Values as plain Python has them, and what each operator sign does with them.

A vector is a tuple, a pose a tuple of rows; for some values Python has no class.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from operator import add, mul, sub, truediv
from typing import Any, Literal

from specc.lang import ranges
from specc.lang.ranges import Operation

Value = Any

PoseRow = tuple[float, float, float, float]
PoseRows = tuple[PoseRow, PoseRow, PoseRow, PoseRow]
"""Rows of the homogeneous transform X_AB."""
Floats = tuple[float, ...]


def compose(X_AB: PoseRows, X_BC: PoseRows) -> PoseRows:
    """X_AC, the product of two homogeneous transforms."""
    a, b, c, d = (_combination(row, X_BC) for row in X_AB)
    return a, b, c, d


def _combination(row: PoseRow, rows: PoseRows) -> PoseRow:
    w, x, y, z = (sum(row[k] * rows[k][j] for k in range(4)) for j in range(4))
    return w, x, y, z


def inverse(X_AB: PoseRows) -> PoseRows:
    """X_BA: the rotation transposed, the origin carried over."""
    p = position(X_AB)
    columns = [tuple(X_AB[i][j] for i in range(3)) for j in range(3)]
    rows = [(*c, -sum(a * b for a, b in zip(c, p, strict=True))) for c in columns]
    return _rows(*rows)


def position(X_AB: PoseRows) -> Floats:
    """Origin of B in the axes of A, metres."""
    return tuple(X_AB[i][3] for i in range(3))


def translation(x_m: float, y_m: float, z_m: float) -> PoseRows:
    """X_AB with the axes of A and the origin of B at (x, y, z) in A."""
    return (
        (1.0, 0.0, 0.0, x_m),
        (0.0, 1.0, 0.0, y_m),
        (0.0, 0.0, 1.0, z_m),
        (0.0, 0.0, 0.0, 1.0),
    )


def pose(p_m: Floats, quaternion_xyzw: Floats) -> PoseRows:
    """X_AB from the origin of B in A and a quaternion, normalised here.

    Raises:
        ValueError: the quaternion is zero or not finite.
    """
    length = math.hypot(*quaternion_xyzw)
    if not 0.0 < length < math.inf:
        raise ValueError(f"quaternion {quaternion_xyzw} has no direction")
    x, y, z, w = (component / length for component in quaternion_xyzw)
    return _rows(
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), p_m[0]),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w), p_m[1]),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y), p_m[2]),
    )


def rotation(axis: Floats, angle_rad: float) -> PoseRows:
    """X_AB with one origin, B turned about an axis in A, which is normalised here (Rodrigues).

    Raises:
        ValueError: the axis is zero.
    """
    largest = max(map(abs, axis))
    if largest == 0.0:
        raise ValueError("an axis of length zero has no direction")
    x, y, z = (component / largest for component in axis)
    length = math.hypot(x, y, z)
    x, y, z = x / length, y / length, z / length
    s, c = math.sin(angle_rad), math.cos(angle_rad)
    v = 1 - c
    return _rows(
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y, 0.0),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x, 0.0),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z, 0.0),
    )


def rpy(roll_rad: float, pitch_rad: float, yaw_rad: float) -> PoseRows:
    """X_AB with one origin, B turned about the fixed axes x, y and z of A, in this order."""
    about_x = rotation((1.0, 0.0, 0.0), roll_rad)
    about_y = rotation((0.0, 1.0, 0.0), pitch_rad)
    about_z = rotation((0.0, 0.0, 1.0), yaw_rad)
    return compose(about_z, compose(about_y, about_x))


def near(a: Any, b: Any, tolerance: float, rotation_rad: float | None = None) -> bool:
    """Numbers and vectors by their largest component, poses by distance and angle."""
    if rotation_rad is not None:
        return math.dist(position(a), position(b)) <= tolerance and angle(a, b) <= rotation_rad
    if isinstance(a, tuple):
        return all(abs(p - q) <= tolerance for p, q in zip(a, b, strict=True))
    return bool(abs(a - b) <= tolerance)


def angle(X: PoseRows, Y: PoseRows) -> float:
    """Angle of the rotation between two orientations, radians; eq. |R_X - R_Y|^2 = 8 sin^2(a/2)."""
    chord = math.dist(
        [X[i][j] for i in range(3) for j in range(3)], [Y[i][j] for i in range(3) for j in range(3)]
    )
    return 2.0 * math.asin(min(chord / math.sqrt(8.0), 1.0))


def _rows(*rows: Any) -> PoseRows:
    a, b, c = rows
    return a, b, c, (0.0, 0.0, 0.0, 1.0)


def elementwise(operation: Callable[[Any, Any], Any], left: Any, right: Any) -> Any:
    """An operation on two numbers, two vectors, or a vector and a number."""
    match left, right:
        case tuple(), tuple():
            return tuple(operation(a, b) for a, b in zip(left, right, strict=True))
        case tuple(), _:
            return tuple(operation(a, right) for a in left)
        case _, tuple():
            return tuple(operation(left, b) for b in right)
    return operation(left, right)


# Values that Python has no class for, how values are written, and when they are alike.


_RELATIVE, _ABSOLUTE = 1e-9, 1e-12
"""What rounding may make of equal numbers."""


class Token:
    """A value that only operators look into; tokens of one name are equal."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Token) and other.name == self.name

    def __hash__(self) -> int:
        return hash(self.name)

    def __repr__(self) -> str:
        return f"Token({self.name!r})"


class NotRecorded:
    """An image, or a value that only operators look into, of which nothing is recorded."""


class Fields:
    """The value of a record; its fields are attributes."""

    def __init__(self, **fields: Value) -> None:
        self.__dict__.update(fields)

    def __iter__(self) -> Iterator[tuple[str, Value]]:
        return iter(self.__dict__.items())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Fields) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(tuple(self.__dict__.items()))

    def __repr__(self) -> str:
        return f"Fields({', '.join(f'{name}={literal_of(value)}' for name, value in self)})"

    def with_field(self, name: str, value: Value) -> Fields:
        """The same record with another value of one field."""
        return Fields(**{**self.__dict__, name: value})


def literal_of(value: Value) -> str:
    """A value as it is written in a test."""
    match value:
        case float():
            return repr(value) if math.isfinite(value) else f'float("{value}")'
        case ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0)):
            return f"translation({x!r}, {y!r}, {z!r})"
        case tuple():
            inside = ", ".join(map(literal_of, value))
            return f"({inside},)" if len(value) == 1 else f"({inside})"
    return repr(value)


def is_close(a: Value, b: Value) -> bool:
    """Whether two values are the same but for rounding; NaN is like NaN."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(is_close, a, b))
    if isinstance(a, Fields) and isinstance(b, Fields):
        return is_close(tuple(a), tuple(b))
    if isinstance(a, float) and isinstance(b, (int, float)):
        both_nan = math.isnan(a) and math.isnan(b)
        return both_nan or math.isclose(a, b, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
    return bool(a == b)


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
    if _is_pose(to):
        return compose(X, to)
    return tuple(sum(row[k] * to[k] for k in range(3)) + row[3] for row in X[:3])  # a point


def _is_pose(value: Any) -> bool:
    return isinstance(value[0], tuple)


def _power(a: Any, b: Any) -> Any:
    return _is_bounded(a, a, abs(b)) and a**b


def _is_bounded(a: Any, b: Any, times: int) -> bool:
    whole = isinstance(a, int) and isinstance(b, int)
    if whole and max(a.bit_length(), b.bit_length()) * (times + 1) > _MOST_BITS:
        raise OverflowError("the result is too large")
    return True


def _divided(value: Any, by: Any) -> Any:
    return elementwise(truediv, value, by) if _is_number(by) and by else None


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


_added, _subtracted = partial(elementwise, add), partial(elementwise, sub)
_multiplied = partial(elementwise, lambda a, b: _is_bounded(a, b, 1) and a * b)

SIGNS = {
    "+": Sign("sum", _added, (_subtracted, _subtracted), ranges.sum_of, commutes=True),
    "-": Sign(
        "sum",
        _subtracted,
        (_added, lambda value, left: _subtracted(left, value)),
        ranges.difference,
    ),
    "*": Sign("product", _multiplied, (_divided, _divided), ranges.product, commutes=True),
    "/": Sign(
        "product",
        partial(elementwise, truediv),
        (lambda value, by: elementwise(mul, value, by) if _is_number(by) else None, None),
        ranges.quotient,
        may_fail=True,
        propagates=1,
    ),
    "**": Sign("power", _power, (None, None), ranges.power, may_fail=True, propagates=1),
    "@": Sign(
        "product",
        _apply_pose,
        (
            lambda value, X: compose(value, inverse(X)) if _is_pose(value) else None,
            lambda value, X: _apply_pose(inverse(X), value),
        ),
    ),
}
