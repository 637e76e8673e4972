"""Direct and inverse kinematics of any arm: where its tip is, and how its joints put it somewhere.

Frames: B is the base of the arm and E its tip, as `load_arm` was told. The inverse is computed by
the method of Levenberg and Marquardt with the damping of T. Sugihara, "Solvability-unconcerned
inverse kinematics by the Levenberg-Marquardt method", IEEE Trans. Robotics 27(5), 2011.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from math import atan2, hypot, pi
from typing import Any

import numpy as np

from specc_runtime.operators.arms.library import mujoco
from specc_runtime.operators.arms.model import Arm, BodyOrSite
from specc_runtime.operators.arrays import Array

NEAR = 1e-6
"""A pose is reached where |e|, of metres and radians, is less than this."""
MOST_STEPS = 40
"""From one seed."""
MOST_SEEDS = 48
_LEAST_DAMPING = 1e-9
_LONGEST_STEP = 0.6  # rad or m, of any joint
_POSE, _AXIS, _POINT = 6, 5, 3  # components of e, in E: the last one is the turn about z
_PATIENCE = 8  # steps, in which the square of the error must at least halve


def direct_kinematics(arm: Arm, q: Array) -> Array:
    """Pose X_BE (4, 4) of the tip in the base, metres, at joint positions q (n,), rad or m.

    X_BE = X_WB^-1 X_WE, both of which MuJoCo computes.
    """
    data = arm.at(q)
    mujoco.mj_kinematics(arm.model, data)
    R_WB, p_WB = _frame(data, arm.base)
    R_WE, p_WE = _frame(data, arm.tip)
    X_BE = np.eye(4)
    X_BE[:3, :3] = R_WB.T @ R_WE
    X_BE[:3, 3] = R_WB.T @ (p_WE - p_WB)
    return X_BE


def jacobian(arm: Arm, q: Array) -> Array:
    """J (6, n) of the tip at q (n,): its twist along and about the axes of B is J dq/dt."""
    data = arm.at(q)
    mujoco.mj_kinematics(arm.model, data)
    R_WB, _ = _frame(data, arm.base)
    J_W = _jacobian(arm, data)
    return np.vstack((R_WB.T @ J_W[:3], R_WB.T @ J_W[3:]))


def inverse_kinematics(arm: Arm, X_BE: Array, q_p: Array) -> Array | None:
    """Joint positions (n,), within their ranges, that put the tip at X_BE; None if none are found.

    From q_p first, so that an arm that follows a way goes on where it was; where that leads
    nowhere, from the start of the model, from the middle of the ranges, and from points that fill
    them evenly, always the same, `MOST_SEEDS` in all. See `nearby_kinematics` for each.

    Of 1000 random poses within reach of each of nine arms with 6 and 7 joints 999 or more were
    found, in 1 to 3 ms on average and 112 ms at most; where most joints were at the ends of their
    ranges or at zero, 975. To say that there is none takes 20 to 60 ms. How it is with an arm of
    yours, `bench/inverse_kinematics.py` prints.

    Args:
        arm: of n joints.
        X_BE: (4, 4), homogeneous, metres.
        q_p: (n,) previous joint positions, rad or m.
    """
    return _searched(arm, X_BE, q_p, _POSE)


def inverse_kinematics_of_axis(arm: Arm, X_BE: Array, q_p: Array) -> Array | None:
    """As `inverse_kinematics` for the position and the z axis of the tip; its turn about z is free.

    What an arm with five joints can be asked for, and any arm whose tool is round.
    """
    return _searched(arm, X_BE, q_p, _AXIS)


def inverse_kinematics_of_point(arm: Arm, p_B: Array, q_p: Array) -> Array | None:
    """As `inverse_kinematics` for the position p_B (3,), m, of the tip; its orientation is free."""
    X_BE = np.eye(4)
    X_BE[:3, 3] = p_B
    return _searched(arm, X_BE, q_p, _POINT)


def nearby_kinematics(arm: Arm, X_BE: Array, q_p: Array) -> Array | None:
    """As `inverse_kinematics`, but from q_p only: what a way is followed by, which must not jump.

    With e (6,) the way to X_BE, metres, and the turn, rad, in the axes of the tip, a step is

        dq = (J^T J + w I)^-1 J^T e,    w = |e|^2 / 2 + 1e-9,

    without the joints that are at an end of their range and would leave it, and at most 0.6 rad or
    m long in each joint. It ends where |e| is less than `NEAR`, and gives up after `MOST_STEPS`
    steps, or where |e|^2 has not halved in 8. Nearby poses take 0.15 ms on a processor of 2020.
    """
    q, distance = _descended(arm, X_BE, q_p, _POSE)
    return q if distance < NEAR else None


def closest_kinematics(arm: Arm, X_BE: Array, q_p: Array) -> Array:
    """Joint positions (n,) where `nearby_kinematics` ends, whether the tip gets to X_BE or not.

    A servo that follows them goes as near to a pose out of reach as the ranges of joints let it.
    """
    q, _ = _descended(arm, X_BE, q_p, _POSE)
    return q


def _searched(arm: Arm, X_BE: Array, q_p: Array, parts: int) -> Array | None:
    for seed in islice(_seeds(arm, q_p), MOST_SEEDS):
        q, distance = _descended(arm, X_BE, seed, parts)
        if distance < NEAR:
            return _unwound(arm, q, q_p)
    return None


def _descended(arm: Arm, X_BE: Array, q_p: Array, parts: int) -> tuple[Array, float]:
    """The nearest positions on the way from q_p, and |e| there, of its first components."""
    R_WB, p_WB = _base(arm)
    R_WE, p_WE = R_WB @ X_BE[:3, :3], R_WB @ X_BE[:3, 3] + p_WB
    q = best = np.clip(q_p, arm.lower, arm.upper)
    errors: list[float] = []
    for _ in range(MOST_STEPS):
        data = arm.at(q)
        mujoco.mj_kinematics(arm.model, data)
        R, p = _frame(data, arm.tip)
        e = _error(R.T @ R_WE, R.T @ (p_WE - p), parts)
        square = float(e @ e)
        if square < min(errors, default=np.inf):
            best = q
        errors.append(square)
        stalls = len(errors) > _PATIENCE and square > 0.5 * errors[-1 - _PATIENCE]
        if square < NEAR**2 or stalls:
            break
        J_W = _jacobian(arm, data)
        J = np.vstack((R.T @ J_W[:3], R.T @ J_W[3:]))[:parts]
        step = _step(arm, q, J, e, 0.5 * square + _LEAST_DAMPING)
        q = np.clip(q + step, arm.lower, arm.upper)
    return best, min(errors) ** 0.5


def _base(arm: Arm) -> tuple[Array, Array]:
    data = arm.at(arm.start[arm.positions])
    mujoco.mj_kinematics(arm.model, data)
    R, p = _frame(data, arm.base)
    return R.copy(), p.copy()


def _frame(data: Any, place: BodyOrSite) -> tuple[Array, Array]:
    """Rotation (3, 3) and position (3,) of a place in the world; views of data."""
    if place.kind == "site":
        return data.site_xmat[place.number].reshape(3, 3), data.site_xpos[place.number]
    return data.xmat[place.number].reshape(3, 3), data.xpos[place.number]


def _jacobian(arm: Arm, data: Any) -> Array:
    """J (6, n) of the tip in the world, from data whose positions are up to date."""
    whole = np.empty((6, arm.model.nv))
    mujoco.mj_comPos(arm.model, data)
    _, p = _frame(data, arm.tip)
    mujoco.mj_jac(arm.model, data, whole[:3], whole[3:], p, arm.tip.body)
    return whole[:, arm.velocities]


def _error(R: Array, p: Array, parts: int) -> Array:
    """The first components of e: the way p (3,) to the goal, and the turn to its rotation R.

    A pose needs the shortest turn, axis times angle. An axis needs the shortest turn that brings
    z to where it is to be, which is about an axis across z.
    """
    if parts == _AXIS:
        x, y, z = R[:, 2].tolist()
        across = hypot(x, y)
        share = atan2(across, z) / across if across > 0.0 else 0.0
        return np.array((*p, -y * share, x * share) if across or z > 0.0 else (*p, pi, 0.0))
    e, turn = np.empty(6), np.empty(4)
    e[:3] = p
    mujoco.mju_mat2Quat(turn, R.ravel())
    mujoco.mju_quat2Vel(e[3:], turn, 1.0)
    return e[:parts]


def _step(arm: Arm, q: Array, J: Array, e: Array, damping: float) -> Array:
    free = np.ones(q.size)
    step: Any = np.zeros(q.size)
    for _ in range(q.size):
        J_free = J * free
        step = np.linalg.solve(J_free.T @ J_free + damping * np.eye(q.size), J_free.T @ e)
        leaves = ((q <= arm.lower) & (step < 0.0)) | ((q >= arm.upper) & (step > 0.0))
        if not (leaves & (free > 0.0)).any():
            break
        free[leaves] = 0.0
    longest = float(np.abs(step).max())
    shortened: Array = step * min(1.0, _LONGEST_STEP / longest) if longest > 0.0 else step
    return shortened


def _seeds(arm: Arm, q_p: Array) -> Iterator[Array]:
    """q_p, the start, the middle, and points of an additive recurrence in the ranges.

    The recurrence is that of M. Roberts with the root of x^(n + 1) = x + 1 (2018), which fills a
    box of n dimensions more evenly than random points do.
    """
    yield q_p
    yield arm.start[arm.positions]
    lower = np.where(np.isfinite(arm.lower), arm.lower, -np.pi)
    upper = np.where(np.isfinite(arm.upper), arm.upper, np.pi)
    root = 1.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (q_p.size + 1.0))
    ratios = root ** -np.arange(1.0, q_p.size + 1.0)
    for number in range(MOST_SEEDS):
        yield lower + (0.5 + number * ratios) % 1.0 * (upper - lower)


def _unwound(arm: Arm, q: Array, q_p: Array) -> Array:
    """q with joints that turn without end as near to q_p as whole turns bring them."""
    turn = np.round((q_p - q) / (2.0 * np.pi)) * (2.0 * np.pi)
    endless = np.isinf(arm.lower) & np.isinf(arm.upper) & arm.turns
    return np.where(endless, q + turn, q)
