"""Joints on their way to a goal, each within its bounds of velocity and acceleration."""

from typing import NamedTuple

import numpy as np

from specc_runtime.operators.arrays import Array


class Motion(NamedTuple):
    """Desired positions q (n,), rad, and velocities v (n,), rad/s, of n joints."""

    q: Array
    v: Array


def at_rest(q: Array) -> Motion:
    """The motion that stays at positions q (n,), rad."""
    return Motion(q, np.zeros_like(q))


def approach(motion: Motion, goal: Array, v_max: Array, a_max: Array, period_s: float) -> Motion:
    """The motion one period later, on the shortest way to rest at the goal within the bounds.

    Every joint moves for itself, at one velocity in each period T, which is at most v_max and
    differs by at most a_max T from the one before. A joint that stops from a velocity of w steps
    of a_max T, k <= w <= k + 1 with k whole, needs

        (k + 1) w - k (k + 1) / 2

    times a_max T^2 until it is at rest. The velocity is the largest from which that is not more
    than the distance to the goal, so that from rest a joint neither passes its goal nor waits
    before it. A joint that is too fast to stop there, as when the goal has just changed, brakes
    and comes back. With bounds v_max of zero every joint brakes until it is at rest.

    Args:
        motion: of n joints.
        goal: (n,) rad.
        v_max, a_max: (n,), rad/s and rad/s2, of which a_max is positive.
        period_s: s, positive.
    """
    q, v = motion
    step = a_max * period_s
    distance = goal - q
    ways = np.abs(distance) / (step * period_s)
    steps = np.floor((np.sqrt(8.0 * ways + 1.0) - 1.0) / 2.0)
    fastest = np.minimum((ways / (steps + 1.0) + steps / 2.0) * step, v_max)
    wanted = np.copysign(fastest, distance)
    bounded = np.clip(wanted, v - step, v + step)
    arrives = (steps == 0.0) & (bounded == wanted) & (fastest < v_max)
    return Motion(np.where(arrives, goal, q + bounded * period_s), bounded)
