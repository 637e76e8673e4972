"""Controllers of joints, for any robot: each component is an axis of its own."""

import numpy as np

from specc_runtime.operators.arrays import Array


def regulated(e: Array, v: Array, K: Array, D: Array) -> Array:
    """K e - D v, component by component: the command of a proportional-derivative controller.

    Args:
        e: (n,) distances from the desired positions, rad or m.
        v: (n,) speeds, rad/s or m/s.
        K: (n,) stiffnesses, command per rad or m.
        D: (n,) dampings, command per rad/s or m/s.
    """
    command: Array = K * e - D * v
    return command


def scaled(v: Array, by: Array) -> Array:
    """(n,) v with each component multiplied by that of `by`: commands of speeds by dampings."""
    product: Array = v * by
    return product


def within(u: Array, least: Array, greatest: Array) -> Array:
    """(n,) u with each component limited to the range from `least` to `greatest`, in one unit."""
    return np.minimum(np.maximum(u, least), greatest)
