"""Records that are goals of ROS 2: their fields have the names that the fields of messages have."""

import math
from typing import NamedTuple

import numpy as np

from specc_runtime.operators.arrays import Array


class JointPoint(NamedTuple):
    """A point of a `trajectory_msgs/JointTrajectory`, for n joints.

    Attributes:
        positions: (n,), rad or m.
        velocities: (n,), rad/s or m/s.
        time_from_start: s, when the joints are there.
    """

    positions: Array
    velocities: Array
    time_from_start: float


def joint_point(positions: Array, time_from_start: float) -> JointPoint:
    """Rest at positions (n,), rad or m, in so many s from the start."""
    return JointPoint(positions, np.zeros_like(positions), time_from_start)


def time_to_rest(positions: Array, goal: Array, v_max: Array, a_max: Array) -> float:
    """The time, s, that joints take together from rest at (n,) positions to rest at a goal.

    They follow cubic polynomials of time, as `ros2_control` makes of points with velocities. One
    that goes as far as d in a time T has the velocity 3 d / 2 T in the middle, and the acceleration
    6 d / T^2 at both ends. The time is the least for which no joint exceeds `v_max` and `a_max`,
    (n,) each and positive.
    """
    distances = np.abs(goal - positions)
    times = np.maximum(1.5 * distances / v_max, np.sqrt(6.0 * distances / a_max))
    return math.ceil(float(times.max()) * 1e3) / 1e3


class GripperGoal(NamedTuple):
    """The goal of a `control_msgs/GripperCommand`.

    Attributes:
        position: m, or rad.
        max_effort: N, or N m.
    """

    position: float
    max_effort: float


def gripper_goal(position: float, max_effort: float) -> GripperGoal:
    """A position, m or rad, to go to with at most that effort, N or N m."""
    return GripperGoal(position, max_effort)
