"""Functions of the specification language itself.

For as few as six numbers numpy is slower: comparisons and norms run on Python floats.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from struct import Struct
from typing import Any, TypeVar, overload

import numpy as np

from specc_runtime.values import Pose, Vector

T = TypeVar("T")
_ARRAY = np.ndarray
_SMALL = 1e-100
_numbers = Struct("16d").unpack


@overload
def near(a: float, b: float, tolerance: float) -> bool: ...
@overload
def near(a: Vector, b: Vector, tolerance: float) -> bool: ...
def near(a: Any, b: Any, tolerance: float) -> bool:
    """Whether every component of `a` lies within `tolerance` of that of `b`; never for NaN.

    Scalars, or vectors of one shape (n,); all three arguments in one unit.
    """
    if isinstance(a, np.ndarray):
        for p, q in zip(a.tolist(), b.tolist(), strict=True):  # noqa: SIM110  # all() costs 0.4 us
            if not abs(p - q) <= tolerance:
                return False
        return True
    return bool(abs(a - b) <= tolerance)


def near_pose(X: Pose, Y: Pose, position_m: float, rotation_rad: float) -> bool:
    """Whether two poses in one frame differ by no more than a distance and an angle.

    The angle is that of the rotation from one to the other. It enters as its chord,
    |R_X - R_Y| = sqrt(8) sin(angle / 2), which unlike the arc cosine is exact for small angles.
    """
    if position_m < 0.0 or rotation_rad < 0.0:
        return False
    (a, b, c, u), (d, e, f, v), (g, h, i, w), _ = X.tolist()
    (j, k, m, x), (n, o, p, y), (q, r, s, z), _ = Y.tolist()
    if not math.hypot(u - x, v - y, w - z) <= position_m:
        return False
    chord = math.hypot(
        a - j, b - k, c - m,
        d - n, e - o, f - p,
        g - q, h - r, i - s,
    )  # fmt: skip
    return chord <= math.sqrt(8.0) * math.sin(0.5 * min(rotation_rad, math.pi))


@overload
def finite(value: float) -> float: ...
@overload
def finite(value: Vector) -> Vector: ...
def finite(value: Any) -> Any:
    """The result of arithmetic, a number or an array (read-only from now on), which is finite.

    Raises OverflowError if it is not.
    """
    if type(value) is _ARRAY:
        numbers = value.tolist() if value.ndim == 1 else value.ravel().tolist()
        if not math.isfinite(sum(numbers, 0.0)) and not np.isfinite(value).all():
            raise OverflowError(f"the result is not finite: {value.tolist()}")
        value.setflags(False)  # type: ignore[call-arg]  # by name it takes twice as long
    elif not math.isfinite(value):
        raise OverflowError(f"the result is not finite: {value}")
    return value


def some(value: T | None) -> T:
    """A value that has been proved to be there; raises ValueError if it is not."""
    if value is None:
        raise ValueError("None where there must be a value")
    return value


def argmax(pairs: Iterable[tuple[float, T]]) -> T:
    """The item with the largest number before it; the first of several. NaN is never the largest.

    Raises ValueError if there is no item.
    """
    return max(pairs, key=_ranked)[1]


def argmin(pairs: Iterable[tuple[float, T]]) -> T:
    """The item with the smallest number before it; the first of several. NaN is never the smallest.

    Raises ValueError if there is no item.
    """
    return max(((-number, item) for number, item in pairs), key=_ranked)[1]


def _ranked(pair: tuple[float, object]) -> tuple[bool, float]:
    """Numbers in their order, NaN before all of them."""
    number = pair[0]
    return (False, 0.0) if math.isnan(number) else (True, number)


def inverse(X_AB: Pose) -> Pose:
    """X_BA of a rigid transform: its rotation transposed, not a general matrix inverse."""
    (a, b, c, u), (d, e, f, v), (g, h, i, w), _ = X_AB.tolist()
    return np.array(
        (
            (a, d, g, -(a * u + d * v + g * w)),
            (b, e, h, -(b * u + e * v + h * w)),
            (c, f, i, -(c * u + f * v + i * w)),
            (0.0, 0.0, 0.0, 1.0),
        )
    )


def vector(*components: float) -> Vector:
    """A read-only vector (n,) of SI numbers; NaN marks a component that is not used."""
    values = np.array(components, dtype=np.float64)
    values.setflags(write=False)
    return values


def read_only(value: Vector) -> Vector:
    """The same array, a vector or a pose, which nobody can change from now on."""
    value.setflags(False)  # type: ignore[call-arg]  # by name it takes twice as long
    return value


def norm(v: Vector) -> float:
    """Euclidean norm of a vector (n,), in its unit."""
    return math.hypot(*v.tolist())


def sign(a: float) -> int:
    """-1, 0 or 1, as a number is negative, zero or positive."""
    return int(a > 0) - int(a < 0)


def wrap_angle(angle_rad: float) -> float:
    """The angle of the same direction in [-pi, pi), radians; a full turn is the float `math.tau`.

    It is exact: IEEE remainders are not rounded. Of the two ends, which are one direction, it gives
    -pi, and of zeros the positive one.
    """
    rest = math.remainder(angle_rad, math.tau)
    return rest + 0.0 if rest < math.pi else -math.pi


def position(X_AB: Pose) -> Vector:
    """Origin of B in the axes of A, (3,), metres."""
    return read_only(X_AB[:3, 3].copy())


def composed(X_AB: Pose, X_BC: Pose) -> Pose:
    """X_AC, read-only; raises OverflowError if it is not finite.

    For matrices as small as these, `@` takes almost three times as long.
    """
    X_AC: Pose = X_AB.dot(X_BC)
    total = sum(_numbers(X_AC), 0.0)  # type: ignore[arg-type]  # arrays are buffers
    return read_only(X_AC) if math.isfinite(total) else finite(X_AC)


def moved(X_AB: Pose, p_B: Vector) -> Vector:
    """A point in A, (3,), metres, that is p in B."""
    (a, b, c, u), (d, e, f, v), (g, h, i, w), _ = X_AB.tolist()
    x, y, z = p_B.tolist()
    return np.array(
        (a * x + b * y + c * z + u, d * x + e * y + f * z + v, g * x + h * y + i * z + w)
    )


def translation(x_m: float, y_m: float, z_m: float) -> Pose:
    """X_AB with the axes of A and the origin of B at (x, y, z) in A."""
    rows = ((1.0, 0.0, 0.0, x_m), (0.0, 1.0, 0.0, y_m), (0.0, 0.0, 1.0, z_m), (0.0, 0.0, 0.0, 1.0))
    return read_only(np.array(rows))


def rotation(axis: Vector, angle_rad: float) -> Pose:
    """X_AB of frames with one origin, B turned about an axis in A, (3,), by Rodrigues' formula.

    The axis need not be of unit length; raises ValueError if it is zero or not finite.
    """
    components = axis.tolist()
    largest = max(map(abs, components))
    if not 0.0 < largest < math.inf:
        raise ValueError(f"axis {components} has no direction")
    x, y, z = (part / largest for part in components)
    length = math.hypot(x, y, z)
    x, y, z = x / length, y / length, z / length
    s, c = math.sin(angle_rad), math.cos(angle_rad)
    v = 1.0 - c
    rows = (
        (c + v * x * x, v * x * y - s * z, v * x * z + s * y, 0.0),
        (v * x * y + s * z, c + v * y * y, v * y * z - s * x, 0.0),
        (v * x * z - s * y, v * y * z + s * x, c + v * z * z, 0.0),
        (0.0, 0.0, 0.0, 1.0),
    )
    return read_only(np.array(rows))


def rpy(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Pose:
    """X_AB of frames with one origin, turned about the fixed axes x, y, z of A, in this order.

    R = Rz(yaw) Ry(pitch) Rx(roll), as in URDF and ROS.
    """
    a, b = math.cos(roll_rad), math.sin(roll_rad)
    c, d = math.cos(pitch_rad), math.sin(pitch_rad)
    e, f = math.cos(yaw_rad), math.sin(yaw_rad)
    rows = (
        (e * c, e * d * b - f * a, e * d * a + f * b, 0.0),
        (f * c, f * d * b + e * a, f * d * a - e * b, 0.0),
        (-d, c * b, c * a, 0.0),
        (0.0, 0.0, 0.0, 1.0),
    )
    return read_only(np.array(rows))


def pose(position_m: Vector, quaternion_xyzw: Vector) -> Pose:
    """X_AB from the origin of B in A, (3,), and its attitude as a quaternion (4,), scalar last.

    The quaternion need not be of unit length; raises ValueError if it is zero or not finite.
    """
    x, y, z, w = components = quaternion_xyzw.tolist()
    square = x * x + y * y + z * z + w * w
    if not _SMALL < square < 1.0 / _SMALL:  # too far from 1 for squares of floats
        largest = max(map(abs, components))
        if not 0.0 < largest < math.inf:
            raise ValueError(f"quaternion {components} has no direction")
        x, y, z, w = (part / largest for part in components)
        square = x * x + y * y + z * z + w * w
    s = 2.0 / square
    p, q, r = position_m.tolist()
    rows = (
        (1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w), p),
        (s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w), q),
        (s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y), r),
        (0.0, 0.0, 0.0, 1.0),
    )
    return read_only(np.array(rows))


def _identity() -> Pose:
    pose = np.eye(4)
    pose.setflags(write=False)
    return pose


_IDENTITY = _identity()


def identity() -> Pose:
    """X_AB of coinciding frames (read-only)."""
    return _IDENTITY
