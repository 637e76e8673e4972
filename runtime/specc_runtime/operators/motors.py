"""Motors of the IRp-6 arm: MJ, JM, the ratio between them, and the motor regulator MR.

Column and N turn with their motors. Ball screws drive the absolute pitches t2 of the lower and t3
of the upper arm, motor T the absolute pitch t4 of the wrist, and motor V is coupled with T
(irp6_robot: Irp6otmM2J.cpp, Irp6otmJ2M.cpp, Irp6otmTransmission.h).
"""

from math import acos, atan2, cos, hypot, pi, sin, sqrt

import numpy as np

from specc_runtime.operators.arrays import Array, vector
from specc_runtime.operators.irp6 import (
    ARM_GAINS,
    ENCODER_COUNTS,
    GEAR_COLUMN,
    GEAR_N,
    GEAR_T,
    GEAR_V,
    LOWER_LENGTH,
    LOWER_MI,
    LOWER_NI,
    SCREW_RAD_PER_MM,
    SCREW_SQUARES,
    SYNCHRO,
    UPPER_LENGTH,
    UPPER_MI,
    UPPER_NI,
)
from specc_runtime.operators.regulator import (
    RegulatorOutput,
    RegulatorState,
    regulate,
    regulator_gains,
    resting_state,
)

_HALF_PI = 0.5 * pi
_S1, _S2, _S3, _S4, _S5, _S6 = SYNCHRO
_LOWER_RADIUS, _LOWER_PHASE = hypot(LOWER_MI, LOWER_NI), atan2(LOWER_NI, LOWER_MI)
_UPPER_RADIUS, _UPPER_PHASE = hypot(UPPER_MI, UPPER_NI), atan2(UPPER_NI, UPPER_MI)
# Jacobian of the motors but for the two ball screws, whose ratios change with the pitches.
_GEARS = np.array(
    (
        (GEAR_COLUMN, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, GEAR_T, GEAR_T, GEAR_T, 0.0, 0.0),
        (0.0, GEAR_T, GEAR_T, GEAR_T, GEAR_V, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0, GEAR_N),
    )
)
_GAINS = tuple(map(regulator_gains, ARM_GAINS, ENCODER_COUNTS))


def motor_to_joint(m: Array) -> Array:
    """MJ: joint positions q (6,) rad of motor positions m (6,) rad (paper, eqs 15 and 18).

    Raises:
        ValueError: a motor position beyond the stroke of its ball screw.
    """
    m1, m2, m3, m4, m5, m6 = m.tolist()
    lower = (m2 - _S2) / SCREW_RAD_PER_MM + LOWER_LENGTH
    upper = (m3 - _S3) / SCREW_RAD_PER_MM + UPPER_LENGTH
    try:
        t2 = -acos((lower * lower - SCREW_SQUARES) / _LOWER_RADIUS) - _LOWER_PHASE
        t3 = -acos((upper * upper - SCREW_SQUARES) / _UPPER_RADIUS) - _UPPER_PHASE
    except ValueError:
        raise ValueError(f"motor position beyond the stroke of a ball screw: m = {m}") from None
    t4 = (m4 - _S4) / GEAR_T
    q5 = ((m5 - _S5) - (m4 - _S4)) / GEAR_V
    q1, q6 = (m1 - _S1) / GEAR_COLUMN, (m6 - _S6) / GEAR_N
    return vector(q1, t2, t3 - t2 - _HALF_PI, t4 - t3, q5, q6)


def joint_to_motor(q: Array) -> Array:
    """JM: motor positions m (6,) rad of joint positions q (6,) rad (paper, eq. 17).

    Inverse of `motor_to_joint` within the motor limits.
    """
    return vector(*motor_positions(*q.tolist()))


def motor_positions(
    q1: float, q2: float, q3: float, q4: float, q5: float, q6: float
) -> tuple[float, float, float, float, float, float]:
    """What `joint_to_motor` computes, for scalars."""
    t3 = q2 + q3 + _HALF_PI
    lower = sqrt(SCREW_SQUARES + LOWER_MI * cos(q2) - LOWER_NI * sin(q2))
    upper = sqrt(SCREW_SQUARES + UPPER_MI * cos(t3) - UPPER_NI * sin(t3))
    from_t = GEAR_T * (t3 + q4)
    return (
        GEAR_COLUMN * q1 + _S1,
        SCREW_RAD_PER_MM * (lower - LOWER_LENGTH) + _S2,
        SCREW_RAD_PER_MM * (upper - UPPER_LENGTH) + _S3,
        from_t + _S4,
        GEAR_V * q5 + from_t + _S5,
        GEAR_N * q6 + _S6,
    )


def motor_ratio(q: Array) -> Array:
    """Jacobian dm/dq (6, 6) of `joint_to_motor` at q (6,) rad.

    Motor torques tau_m, Nm, act on the joints as (dm/dq)^T tau_m.
    """
    ratio = _GEARS.copy()
    ratio[1, 1], ratio[2, 1:3] = _screw_ratios(float(q[1]), float(q[1] + q[2]) + _HALF_PI)
    return ratio


def motor_torque(tau: Array, q: Array) -> Array:
    """Motor torques (6,) Nm that act as joint torques tau (6,) Nm at q (6,) rad: (dm/dq)^-T tau."""
    lower, upper = _screw_ratios(float(q[1]), float(q[1] + q[2]) + _HALF_PI)
    tau1, tau2, tau3, tau4, tau5, tau6 = tau.tolist()
    v = tau5 / GEAR_V
    return vector(
        tau1 / GEAR_COLUMN,
        (tau2 - tau3) / lower,
        (tau3 - tau4) / upper,
        tau4 / GEAR_T - v,
        v,
        tau6 / GEAR_N,
    )


def initial_regulator_state() -> RegulatorState:
    """State of the motor regulators before their first period: six axes at rest.

    The error before the first period counts as zero, so that the first error acts in full and no
    offset is left; there is no bump when the desired position starts at the measured one.
    """
    return resting_state(6)


def motor_regulator(error: Array, state: RegulatorState, feedforward: Array) -> RegulatorOutput:
    """MR: desired motor currents (paper, eqs 14, 17 and 27; law in `regulator.regulate`).

    Args:
        error: (6,) desired minus measured motor positions, rad.
        state: what the last period returned, or `initial_regulator_state()`.
        feedforward: (6,) A, added before clipping, e.g. `dynamics.gravity_feedforward`.
    """
    currents, after = regulate(_GAINS, error.tolist(), state, feedforward.tolist())
    return RegulatorOutput(vector(*currents), after)


def _screw_ratios(t2: float, t3: float) -> tuple[float, float]:
    """Derivatives of the motors of lower and upper arm by their absolute pitches."""
    c2, s2, c3, s3 = cos(t2), sin(t2), cos(t3), sin(t3)
    lower = sqrt(SCREW_SQUARES + LOWER_MI * c2 - LOWER_NI * s2)
    upper = sqrt(SCREW_SQUARES + UPPER_MI * c3 - UPPER_NI * s3)
    half = -0.5 * SCREW_RAD_PER_MM
    return (
        half * (LOWER_MI * s2 + LOWER_NI * c2) / lower,
        half * (UPPER_MI * s3 + UPPER_NI * c3) / upper,
    )
