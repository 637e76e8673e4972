"""Straight ways of the tip of an arm: position along a line, orientation about one axis.

A way goes from X_0 to X_1 by a share s from 0 to 1. With d = p_1 - p_0 and u the axis times the
angle of the shortest turn R_1 R_0^T,

    p(s) = p_0 + s d,    R(s) = exp(s u) R_0,

so that the tip has velocity |d| ds/dt and angular velocity |u| ds/dt: bounds of s and of its
derivatives are bounds of both (K. M. Lynch, F. C. Park, "Modern Robotics", 2017, 9.2).
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np

from specc_runtime.operators.approach import Motion
from specc_runtime.operators.arms.kinematics import direct_kinematics, nearby_kinematics
from specc_runtime.operators.arms.library import mujoco
from specc_runtime.operators.arms.model import Arm
from specc_runtime.operators.arrays import Array

_SAMPLE_M, _SAMPLE_RAD = 0.02, 0.1
_MOST_SAMPLES = 100
_LONGEST_RAD = 0.5  # of a joint from one sample to the next; more is a jump to another posture
_SHARE_OF_BOUND = 0.9  # of the velocities of joints, which are looked at in samples only

_SHORTEST_S = 1e-3  # that a way takes, so that one of no length has bounds


class Way(NamedTuple):
    """From X_0 to X_1 (4, 4), and bounds v (1,) and a (1,) of ds/dt, 1/s, and its change, 1/s2."""

    X_0: Array
    X_1: Array
    v: Array
    a: Array


def between(X_0: Array, X_1: Array, s: Array) -> Array:
    """The pose (4, 4) at the share s (1,) of the way from X_0 to X_1 (4, 4)."""
    share = float(s[0])
    turn, R = np.empty(4), np.empty(9)
    u = _turn(X_0, X_1)
    angle = float(np.linalg.norm(u))
    mujoco.mju_axisAngle2Quat(turn, u / angle if angle > 0.0 else u, share * angle)
    mujoco.mju_quat2Mat(R, turn)
    X = np.eye(4)
    X[:3, :3] = R.reshape(3, 3) @ X_0[:3, :3]
    X[:3, 3] = X_0[:3, 3] + share * (X_1[:3, 3] - X_0[:3, 3])
    return X


def straight_way(
    arm: Arm,
    q: Array,
    X_d: Array,
    v_max: float,
    a_max: float,
    w_max: float,
    alpha_max: float,
    q_v_max: Array,
) -> Way | None:
    """The straight way of the tip from where it is at q (n,) to X_d; None if the arm cannot go it.

    Inverse kinematics is asked at samples 2 cm and 0.1 rad apart, 100 at most, from q on. It cannot
    go a way on which a range of a joint ends, or on which it would have to jump to another posture.
    Where joints turn fast for a small motion of the tip, the whole way is gone so slowly that they
    stay below q_v_max.

    Args:
        arm: of n joints.
        q: (n,) rad or m, where the arm is.
        X_d: (4, 4), metres, in the base of the arm.
        v_max, a_max: of the tip, m/s and m/s2.
        w_max, alpha_max: of its turning, rad/s and rad/s2.
        q_v_max: (n,) of the joints, rad/s or m/s.
    """
    X_0 = direct_kinematics(arm, q)
    length, angle = float(np.linalg.norm(X_d[:3, 3] - X_0[:3, 3])), _angle(X_0, X_d)
    count = min(max(ceil(length / _SAMPLE_M), ceil(angle / _SAMPLE_RAD), 1), _MOST_SAMPLES)
    slope = np.zeros_like(q)
    for number in range(1, count + 1):
        after = nearby_kinematics(arm, between(X_0, X_d, np.array([number / count])), q)
        if after is None or np.abs(after - q).max() > _LONGEST_RAD:
            return None
        slope = np.maximum(slope, np.abs(after - q) * count)
        q = after
    slowest = float((slope / q_v_max).max()) / _SHARE_OF_BOUND
    v = 1.0 / max(length / v_max, angle / w_max, slowest, _SHORTEST_S)
    a = 1.0 / max(length / a_max, angle / alpha_max, _SHORTEST_S**2)
    return Way(X_0, X_d.copy(), np.array([v]), np.array([a]))


def on_way(
    arm: Arm, way: Way, s: Array, motion: Motion, q_v_max: Array, period_s: float
) -> Motion | None:
    """The motion that brings the tip to the share s (1,) of a way, a period after `motion`.

    None if there is none from there, or only one on which a joint is faster than q_v_max (n,).
    """
    q = nearby_kinematics(arm, between(way.X_0, way.X_1, s), motion.q)
    if q is None or (np.abs(q - motion.q) > q_v_max * period_s).any():
        return None
    return Motion(q, (q - motion.q) / period_s)


def no_way() -> Way:
    """The way of no length, from the base to the base: what there is before a first way."""
    return Way(np.eye(4), np.eye(4), np.full(1, 1.0 / _SHORTEST_S), np.full(1, _SHORTEST_S**-2))


def _turn(X_0: Array, X_1: Array) -> Array:
    """u (3,), rad: axis times angle, 0 to pi, of the turn from X_0 to X_1, in their frame."""
    quaternion, u = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quaternion, (X_1[:3, :3] @ X_0[:3, :3].T).ravel())
    mujoco.mju_quat2Vel(u, quaternion, 1.0)
    return u


def _angle(X_0: Array, X_1: Array) -> float:
    return float(np.linalg.norm(_turn(X_0, X_1)))
