"""Values as plain Python has them: what the language computes, how they are written, when alike.

A vector is a tuple, a pose a tuple of rows; for some values Python has no class.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

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


def transform_point(X_AB: PoseRows, p_B: Floats) -> Floats:
    """The point p in A, metres."""
    return tuple(sum(row[k] * p_B[k] for k in range(3)) + row[3] for row in X_AB[:3])


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
