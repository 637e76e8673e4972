"""MI: synchronised interpolation between two rests in motor space."""

from math import sqrt

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.irp6 import (
    ARM_GAINS,
    CONTROL_PERIOD_S,
    ENCODER_COUNTS,
    MOTOR_ACCELERATION,
    MOTOR_DAMPING,
    MOTOR_SPEED,
    TORQUE_CONSTANT,
    TRIP_COUNTS_PER_PERIOD,
)

# Of the speed and acceleration limits, what a motion uses at its peak; the rest is for the
# regulator's corrections.
MOTION_FRACTION = 0.95
# A, set aside for gravity (rounded up over the poses above the table) before friction may use
# MOTION_CURRENT_FRACTION of what is left of the largest current.
GRAVITY_RESERVE_A = (0.0, 5.0, 5.0, 1.0, 0.1, 0.1)
MOTION_CURRENT_FRACTION = 0.8

_TRIP_SPEED = 2.0 * np.pi * TRIP_COUNTS_PER_PERIOD / (np.array(ENCODER_COUNTS) * CONTROL_PERIOD_S)
_CURRENT = np.array([row[5] / 1000.0 for row in ARM_GAINS]) - np.array(GRAVITY_RESERVE_A)
_CURRENT_SPEED = MOTION_CURRENT_FRACTION * _CURRENT * TORQUE_CONSTANT / np.array(MOTOR_DAMPING)
PEAK_SPEED = np.minimum(
    MOTION_FRACTION * np.minimum(MOTOR_SPEED, _TRIP_SPEED), _CURRENT_SPEED
)  # (6,) rad/s
PEAK_ACCELERATION = MOTION_FRACTION * MOTOR_ACCELERATION  # rad/s2

# Peaks of the quintic s(x) = 10 x^3 - 15 x^4 + 6 x^5: s' = 15/8, s'' = 10/sqrt(3).
_SECONDS_PER_RAD = (15.0 / 8.0) / PEAK_SPEED
_SQUARE_SECONDS_PER_RAD = (10.0 / sqrt(3.0)) / PEAK_ACCELERATION


def interpolation_duration(m_start: Array, m_goal: Array) -> float:
    """Seconds that `motor_interpolation` takes from m_start to m_goal (6,) rad.

    One period at least. The slowest axis decides: none exceeds PEAK_SPEED or PEAK_ACCELERATION,
    which keep clear of the motors' limits, of the speed at which the regulator trips, and of the
    largest currents.
    """
    distance = np.abs(m_goal - m_start)
    by_speed: float = max((distance * _SECONDS_PER_RAD).tolist())
    by_acceleration = sqrt(max(distance.tolist()) * _SQUARE_SECONDS_PER_RAD)
    return max(by_speed, by_acceleration, CONTROL_PERIOD_S)


def motor_interpolation(m_start: Array, m_goal: Array, elapsed_s: float) -> Array:
    """MI: motor positions (6,) rad, elapsed_s after leaving m_start for m_goal (paper, 4.5).

    All axes follow one quintic from rest to rest and arrive together. Before the start it returns
    m_start, after `interpolation_duration` exactly m_goal.

    Args:
        m_start, m_goal: (6,) rad.
        elapsed_s: time since the motion began.
    """
    duration = interpolation_duration(m_start, m_goal)
    if elapsed_s >= duration:
        return m_goal.copy()
    x = max(elapsed_s / duration, 0.0)
    progress = x * x * x * (10.0 + x * (6.0 * x - 15.0))
    return m_start + progress * (m_goal - m_start)
