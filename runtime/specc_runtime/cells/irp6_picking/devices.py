"""Devices of the IRp-6: what lies between its amplifiers and encoders and the joints of the model.

Drives of the arm. Each amplifier carries the commanded current i, limited to its Imax. The motors
give kt i, which acts on the joints through the transmission: tau = (dm/dq)^T kt i. Rotor inertia
and viscous friction are armature and damping in the model file, so no friction appears here.

Gripper. A motor with a screw that does not drive back. Its current presses the fingers together
with 670 N/A; Coulomb friction of 26.8 N, in the model file, takes the first 40 mA. So fingers at
rest stay where they are up to 40 mA, and a stalled drive grips with 0.67 N for each mA above: 40 N
at 100 mA. (Assumed numbers; the paper only tells that 100 mA means a grasped object.)

Wrist force sensor. MuJoCo reports what holds the hand; the sensor reports what the hand exerts on
it. A hand at rest reads its weight, pointing down.
"""

from typing import Final

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.gripper import distance_to_motor
from specc_runtime.operators.irp6 import ARM_GAINS, TORQUE_CONSTANT
from specc_runtime.operators.motors import joint_to_motor, motor_ratio
from specc_runtime.operators.regulator import clipped

_AXES = 6
_LARGEST_CURRENT: Final = tuple(gains[-1] / 1000.0 for gains in ARM_GAINS)
GRIP_N_PER_A = 670.0
GRIPPER_OVERCURRENT_A = 0.2  # the amplifier's own limit


def motor_positions(raw: Array) -> Array:
    """Positions of the motors (6,) rad, from raw = joint positions (6,) rad."""
    return joint_to_motor(raw)


def drive_torques(currents: Array, raw: Array) -> Array:
    """Joint torques (6,) Nm that motor currents (6,) A give.

    Args:
        currents: commanded; limited here to what the amplifiers carry.
        raw: joint positions (6,) rad, then anything.
    """
    of_motors = [
        TORQUE_CONSTANT * clipped(current, largest)
        for current, largest in zip(currents.tolist(), _LARGEST_CURRENT, strict=True)
    ]
    torques: Array = motor_ratio(raw[:_AXES]).T @ np.array(of_motors)
    return torques


def wrist_wrench(raw: Array) -> Array:
    """Wrench (6,) N, Nm that the hand exerts on the sensor, in its axes and at its origin.

    Args:
        raw: MuJoCo's force (3,) and torque (3,) sensors at the sensor's site.
    """
    return -raw


def finger_distance(raw: Array) -> float:
    """Distance between the fingers, m, from raw = positions (2,) of both finger slides, m."""
    return float(raw[0] + raw[1])


def gripper_motor_position(raw: Array) -> float:
    """Position of the gripper's motor, rad, from raw = positions (2,) of both slides, m."""
    return distance_to_motor(finger_distance(raw))


def gripper_force(current: float, raw: Array) -> float:
    """Force along the finger distance, N, positive opening, of a motor current in A.

    A positive current turns the motor forward, which closes the fingers.
    """
    return -GRIP_N_PER_A * min(max(current, -GRIPPER_OVERCURRENT_A), GRIPPER_OVERCURRENT_A)


def gripper_current(raw: Array) -> float:
    """Current that the gripper's motor carries, A, from raw = force (1,) of its actuator, N."""
    return float(-raw[0] / GRIP_N_PER_A)
