"""The two-finger gripper tfg: its transmission, its regulator and its motion profile.

The finger joint is the distance between the fingers; the motor's position grows as they close.
"""

from math import copysign, sqrt
from typing import NamedTuple

from specc_runtime.operators.irp6 import (
    FINGERS_A0,
    FINGERS_A1,
    FINGERS_A2,
    FINGERS_SPEED,
    GRIPPER_ENCODER_COUNTS,
    GRIPPER_GAINS,
)
from specc_runtime.operators.regulator import (
    RegulatorState,
    regulate,
    regulator_gains,
    resting_state,
)

RAMP_S = 0.25  # time to reach and to leave FINGERS_SPEED

_GAINS = (regulator_gains(GRIPPER_GAINS, GRIPPER_ENCODER_COUNTS),)
_APEX = -FINGERS_A1 / (2.0 * FINGERS_A2)  # motor position of the largest distance, rad
_LARGEST = FINGERS_A0 - FINGERS_A2 * _APEX * _APEX  # m


class GripperOutput(NamedTuple):
    """Desired current c_d, A, and the state to be given to the next call."""

    c_d: float
    state: RegulatorState


def motor_to_distance(m_rad: float) -> float:
    """Distance between the fingers, m, at a motor position in rad (irp6tfg: Irp6tfgM2J.cpp)."""
    return (FINGERS_A2 * m_rad + FINGERS_A1) * m_rad + FINGERS_A0


def distance_to_motor(d_m: float) -> float:
    """Motor position, rad, at which the fingers are d_m metres apart.

    The exact inverse of `motor_to_distance` on its branch above the apex; the published inverse
    (irp6tfg: Irp6tfgJ2M.cpp) is the same to its rounding.

    Raises:
        ValueError: wider than the transmission can open.
    """
    if d_m > _LARGEST:
        raise ValueError(f"fingers cannot be {d_m} m apart; at most {_LARGEST:.4f} m")
    return _APEX + sqrt((d_m - _LARGEST) / FINGERS_A2)


def initial_gripper_regulator_state() -> RegulatorState:
    """State of the gripper's regulator before its first period: at rest."""
    return resting_state(1)


def gripper_regulator(error_rad: float, state: RegulatorState) -> GripperOutput:
    """Desired current of the gripper's motor (law in `regulator.regulate`).

    Args:
        error_rad: desired minus measured motor position.
        state: what the last period returned, or `initial_gripper_regulator_state()`.
    """
    (current,), after = regulate(_GAINS, (error_rad,), state, (0.0,))
    return GripperOutput(current, after)


def gripper_interpolation_duration(d_start: float, d_goal: float) -> float:
    """Seconds that `gripper_interpolation` takes between two distances in m."""
    distance = abs(d_goal - d_start)
    if distance >= FINGERS_SPEED * RAMP_S:
        return distance / FINGERS_SPEED + RAMP_S
    return 2.0 * sqrt(distance * RAMP_S / FINGERS_SPEED)


def gripper_interpolation(d_start: float, d_goal: float, elapsed_s: float) -> float:
    """Desired distance between the fingers, m, elapsed_s after leaving d_start for d_goal.

    Constant FINGERS_SPEED between two ramps of RAMP_S, shorter ones for a short way, so that the
    current stays that of free running and a rise of it means contact. Before the start it returns
    d_start, after `gripper_interpolation_duration` exactly d_goal.
    """
    duration = gripper_interpolation_duration(d_start, d_goal)
    if elapsed_s >= duration:
        return d_goal
    if elapsed_s <= 0.0:
        return d_start
    acceleration = copysign(FINGERS_SPEED / RAMP_S, d_goal - d_start)
    ramp = min(RAMP_S, 0.5 * duration)
    left = duration - elapsed_s
    if left < ramp:
        return d_goal - 0.5 * acceleration * left * left
    if elapsed_s < ramp:
        return d_start + 0.5 * acceleration * elapsed_s * elapsed_s
    return d_start + acceleration * ramp * (elapsed_s - 0.5 * ramp)
