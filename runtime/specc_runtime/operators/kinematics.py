"""Kinematics of the IRp-6 arm in closed form: DK, IK and whether a pose can be reached.

Pitches count from the horizontal, downwards positive: t2 = q2 of the lower arm, t3 = q2 + q3 + pi/2
of the upper arm, t4 = t3 + q4 of the wrist. In the plane of the arm the V axis is
v = (cos t4, -sin t4) and its normal u = (sin t4, cos t4); the tool axis is
a = sin q5 u + cos q5 b, with b normal to the plane. E lies beyond the wrist along a
(irp6_robot: Irp6otmForwardKinematic.cpp, Irp6otmInverseKinematic.cpp).
"""

from math import atan2, cos, hypot, pi, sin, sqrt

from specc_runtime.operators.arrays import Array, transform, vector
from specc_runtime.operators.irp6 import (
    JOINT_LOWER,
    JOINT_UPPER,
    LOWER_ARM,
    MOTOR_LOWER,
    MOTOR_UPPER,
    SHOULDER_HEIGHT,
    TOOL,
    UPPER_ARM,
    WRIST,
)
from specc_runtime.operators.motors import motor_positions

_PI = pi
_HALF_PI = 0.5 * pi
_TURN = 2.0 * pi
_SINGULAR = 1e-10  # of sin q5
# A turn of N that would leave the limits is undone only in a target this far from the previous
# position: a servo that creeps over the limit must not jump by a whole turn.
_SERVO_STEP = 0.05
_LIMIT_SLACK = 1e-9  # rad, for rounding

_Joints = tuple[float, float, float, float, float, float]


class UnreachablePose(ValueError):
    """A pose of E that the arm cannot take; holds the pose X_BE and the reason."""

    def __init__(self, X_BE: Array, reason: str) -> None:
        """Keep X_BE (4, 4) and the reason."""
        x, y, z = X_BE[:3, 3].tolist()
        super().__init__(f"pose of E at ({x:.4f}, {y:.4f}, {z:.4f}) m in B is {reason}")
        self.X_BE = X_BE
        self.reason = reason


def direct_kinematics(q: Array) -> Array:
    """DK: pose X_BE (4, 4) of E in B, metres, for joint positions q (6,) rad (paper, eq. 15)."""
    q1, q2, q3, q4, q5, q6 = q.tolist()
    t3 = q2 + q3 + _HALF_PI
    t4 = t3 + q4
    c1, s1, c4, s4 = cos(q1), sin(q1), cos(t4), sin(t4)
    c5, s5, c6, s6 = cos(q5), sin(q5), cos(q6), sin(q6)
    # Columns n, o and a of the wrist by their parts along the arm (r), across it (b) and up (z).
    a_r, a_z = s5 * s4, s5 * c4
    n_r, n_z = c6 * c5 * s4 + s6 * c4, c6 * c5 * c4 - s6 * s4
    o_r, o_z = c6 * c4 - s6 * c5 * s4, -s6 * c5 * c4 - c6 * s4
    n_b, o_b = -c6 * s5, s6 * s5
    r = LOWER_ARM * cos(q2) + UPPER_ARM * cos(t3) + WRIST * c4 + TOOL * a_r
    b = TOOL * c5
    z = SHOULDER_HEIGHT - LOWER_ARM * sin(q2) - UPPER_ARM * sin(t3) - WRIST * s4 + TOOL * a_z
    return transform(
        *(c1 * n_r - s1 * n_b, c1 * o_r - s1 * o_b, c1 * a_r - s1 * c5, c1 * r - s1 * b),
        *(s1 * n_r + c1 * n_b, s1 * o_r + c1 * o_b, s1 * a_r + c1 * c5, s1 * r + c1 * b),
        *(n_z, o_z, a_z, z),
    )


def inverse_kinematics(X_BE: Array, q_p: Array) -> Array:
    """IK: joint positions q (6,) rad that put E at X_BE (4, 4) in B (paper, eq. 17).

    Of the two wrists the one with the sign of the previous sin q5 is taken, of the turns of q5 and
    q6 those nearest to q_p. When V's axis and the tool's coincide (sin q5 = 0), t4 is kept from
    q_p. A turn of q6 that leaves the limits is undone, unless q6 is nearly where it was.

    Args:
        X_BE: homogeneous, metres.
        q_p: (6,) rad, previous joint positions.

    Raises:
        UnreachablePose: beyond the stretched or folded arm, or outside the limits of a joint or
            of a motor.
    """
    previous: _Joints = tuple(q_p.tolist())
    q = _solve(X_BE, previous)
    if q is None:
        raise UnreachablePose(X_BE, "out of the arm's reach")
    fault = _limit_fault(q)
    if fault:
        raise UnreachablePose(X_BE, f"reached only with {fault}")
    return vector(*q)


def reachable(X_BE: Array, q_p: Array) -> bool:
    """Whether `inverse_kinematics` of X_BE (4, 4) from previous joints q_p (6,) has an answer."""
    previous: _Joints = tuple(q_p.tolist())
    q = _solve(X_BE, previous)
    return q is not None and not _limit_fault(q)


def _solve(X_BE: Array, q_p: _Joints) -> _Joints | None:
    """Joint positions regardless of limits, None out of reach."""
    (nx, ox, ax, px), (ny, oy, ay, py), (nz, oz, az, pz), _ = X_BE.tolist()
    _, q2_p, q3_p, q4_p, q5_p, q6_p = q_p
    px, py, pz = px - TOOL * ax, py - TOOL * ay, pz - TOOL * az - SHOULDER_HEIGHT
    radius = hypot(px, py)
    if radius == 0.0:  # above the column, where q1 has no meaning and the arm cannot fold to
        return None
    c1, s1 = px / radius, py / radius
    n_r, o_r, a_r = c1 * nx + s1 * ny, c1 * ox + s1 * oy, c1 * ax + s1 * ay
    a_b = c1 * ay - s1 * ax

    sign = 1.0 if q5_p - _nearest(0.0, q5_p) > 0.0 else -1.0
    s5 = sign * hypot(a_r, az)
    q5 = _nearest(atan2(s5, a_b), q5_p)
    t4 = q2_p + q3_p + q4_p + _HALF_PI
    if abs(s5) > _SINGULAR:
        t4 = _nearest(atan2(sign * a_r, sign * az), t4)
    c4, s4 = cos(t4), sin(t4)
    q6 = atan2(n_r * c4 - nz * s4, o_r * c4 - oz * s4)  # n and o along the V axis
    q6 = _turn_of_n(_nearest(q6, q6_p), q6_p)

    elbow = _elbow(radius - WRIST * c4, -pz - WRIST * s4)
    if elbow is None:
        return None
    t2, t3 = elbow
    return atan2(py, px), t2, t3 - t2 - _HALF_PI, t4 - t3, q5, q6


def _elbow(e: float, f: float) -> tuple[float, float] | None:
    """Pitches t2, t3 that put the end of the upper arm e before and f below the shoulder."""
    squares = e * e + f * f
    k = squares + (LOWER_ARM * LOWER_ARM - UPPER_ARM * UPPER_ARM)
    rho = 2.0 * LOWER_ARM * sqrt(squares)
    if abs(k) > rho:
        return None
    t2 = atan2(k, sqrt(rho * rho - k * k)) - atan2(e, f)
    if t2 <= -_PI:
        t2 += _TURN
    return t2, atan2(f - LOWER_ARM * sin(t2), e - LOWER_ARM * cos(t2))


def _nearest(angle: float, reference: float) -> float:
    """The angle plus whole turns, nearest to the reference."""
    return angle + _TURN * round((reference - angle) / _TURN)


def _turn_of_n(q6: float, q6_p: float) -> float:
    """The turn of N inside its limits, if the arm is to move at all; see `_SERVO_STEP`."""
    if abs(q6 - q6_p) > _SERVO_STEP:
        if q6 > JOINT_UPPER[5]:
            return q6 - _TURN
        if q6 < JOINT_LOWER[5]:
            return q6 + _TURN
    return q6


def _limit_fault(q: _Joints) -> str:
    """The first joint or motor outside its limits, in words; empty when all are inside."""
    for name, values, lower, upper in (
        ("joint", q, JOINT_LOWER, JOINT_UPPER),
        ("motor", motor_positions(*q), MOTOR_LOWER, MOTOR_UPPER),
    ):
        for i, value in enumerate(values):
            if not lower[i] - _LIMIT_SLACK <= value <= upper[i] + _LIMIT_SLACK:
                return f"{name} {i + 1} at {value:.4f} rad, outside [{lower[i]}, {upper[i]}]"
    return ""
