"""Motions with bounded velocity, acceleration and jerk, from any motion to rest. Knows of Ruckig.

A trajectory is planned once, when there is a new goal, and sampled in each period after it, so that
a goal that changes on the way starts from where the motion is, without a step in acceleration. All
axes arrive together, as soon as the slowest can (L. Berscheid, T. Kroeger, "Jerk-limited real-time
trajectory generation with arbitrary target states", Robotics: Science and Systems, 2021).

Axes are anything with n components: joints, or the one share of a straight way, for which
`specc_runtime.operators.arms.ways` has bounds and poses. A specification declares, for seven:

    types:
      State:
        fields: {q: "vector[7, rad]", v: "vector[7, rad/s]", a: "vector[7, rad/s**2]"}
        python: "specc_runtime.operators.trajectories:State"
      Trajectory:
        opaque: true
        python: "specc_runtime.operators.trajectories:Trajectory"
        codec:
          encode: "specc_runtime.operators.trajectories:encode_trajectory"
          decode: "specc_runtime.operators.trajectories:decode_trajectory"
    operators:
      resting:
        signature: "(q: vector[7, rad]) -> State"
        python: "specc_runtime.operators.trajectories:resting"
      planned:
        signature: >-
          (start: State, goal: vector[7, rad], v_max: vector[7, rad/s], a_max: vector[7, rad/s**2],
          j_max: vector[7, rad/s**3]) -> Trajectory
        python: "specc_runtime.operators.trajectories:planned"
      sampled:
        signature: "(trajectory: Trajectory, elapsed: real[s]) -> State"
        python: "specc_runtime.operators.trajectories:sampled"
"""

from __future__ import annotations

import atexit
import gc
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import ruckig

from specc_runtime.operators.arrays import Array

_ARRIVED_S = 1e-9
_PARTS = 7

# The package prints warnings at the end of a process that has left its objects to the system.
atexit.register(gc.unfreeze)


class State(NamedTuple):
    """Positions q (n,), rad, velocities v (n,), rad/s, and accelerations a (n,), rad/s2."""

    q: Array
    v: Array
    a: Array


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """From a state to rest at the goal, or to rest anywhere; made by `planned` and `stopping`.

    Attributes:
        start: where it begins.
        goal: (n,) rad, not a number where it is to rest anywhere.
        v_max, a_max, j_max: (n,) its bounds, rad/s, rad/s2, rad/s3.
        duration_s: how long it takes.
    """

    start: State
    goal: Array
    v_max: Array
    a_max: Array
    j_max: Array
    duration_s: float
    _plan: Any

    def __deepcopy__(self, memo: object) -> Trajectory:
        """Itself, since nothing of it changes."""
        return self


def resting(q: Array) -> State:
    """The state at rest at positions q (n,), rad."""
    return State(q, np.zeros_like(q), np.zeros_like(q))


def planned(start: State, goal: Array, v_max: Array, a_max: Array, j_max: Array) -> Trajectory:
    """The trajectory from a state to rest at the goal, on which all axes arrive together.

    A start that exceeds a bound comes back within it first. It takes 0.05 ms for seven axes.

    Args:
        start: of n axes.
        goal: (n,) rad.
        v_max, a_max, j_max: (n,), rad/s, rad/s2, rad/s3, positive.

    Raises:
        ValueError: a bound is not positive; or Ruckig finds no trajectory, as where numbers are not
            finite or differ by many orders of magnitude.
    """
    request = _request(start, a_max, j_max)
    request.target_position, request.max_velocity = goal, v_max
    return _solved(request, start, goal, v_max, a_max, j_max)


def stopping(start: State, a_max: Array, j_max: Array) -> Trajectory:
    """The shortest trajectory from a state to rest, wherever that is; see `planned`."""
    request = _request(start, a_max, j_max)
    request.control_interface = ruckig.ControlInterface.Velocity
    anywhere = np.full_like(start.q, np.nan)
    return _solved(request, start, anywhere, np.full_like(start.q, np.inf), a_max, j_max)


def sampled(trajectory: Trajectory, elapsed_s: float) -> State:
    """The state `elapsed_s` after the beginning; exactly at rest once `duration_s` is over."""
    left = trajectory.duration_s - elapsed_s
    if left > _ARRIVED_S:
        q, v, a = trajectory._plan.at_time(max(elapsed_s, 0.0))
        return State(np.array(q), np.array(v), np.array(a))
    end = np.array(trajectory._plan.at_time(trajectory.duration_s)[0])
    return resting(np.where(np.isnan(trajectory.goal), end, trajectory.goal))


def remaining(trajectory: Trajectory, elapsed_s: float) -> float:
    """How long, in s, it is until rest, `elapsed_s` after the beginning; not negative."""
    return max(trajectory.duration_s - elapsed_s, 0.0)


def encode_trajectory(trajectory: Trajectory) -> bytes:
    """What it was planned from, as floats."""
    t = trajectory
    return np.stack((*t.start, t.goal, t.v_max, t.a_max, t.j_max)).tobytes()


def decode_trajectory(data: bytes) -> Trajectory:
    """See `encode_trajectory`. Raises ValueError for other bytes."""
    q, v, a, goal, v_max, a_max, j_max = np.frombuffer(data).reshape(_PARTS, -1).copy()
    if np.isnan(goal).any():
        return stopping(State(q, v, a), a_max, j_max)
    return planned(State(q, v, a), goal, v_max, a_max, j_max)


def _request(start: State, a_max: Array, j_max: Array) -> Any:
    request = ruckig.InputParameter(start.q.size)
    request.current_position, request.current_velocity, request.current_acceleration = start
    request.max_acceleration, request.max_jerk = a_max, j_max
    return request


def _solved(
    request: Any, start: State, goal: Array, v_max: Array, a_max: Array, j_max: Array
) -> Trajectory:
    if min(v_max.min(), a_max.min(), j_max.min()) <= 0.0:
        raise ValueError("bounds of velocity, acceleration and jerk have to be positive")
    plan = ruckig.Trajectory(start.q.size)
    try:
        ruckig.Ruckig(start.q.size).calculate(request, plan)
    except ruckig.RuckigError as error:
        raise ValueError(f"there is no trajectory: {str(error).strip()}") from error
    return Trajectory(start, goal, v_max, a_max, j_max, float(plan.duration), plan)
