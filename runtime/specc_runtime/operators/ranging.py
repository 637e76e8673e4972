"""Where the beams of range finders met something."""

from __future__ import annotations

import numpy as np

from specc_runtime.operators.arrays import Array


def echoes(
    at: Array, heading_rad: float, d: Array, angles_rad: Array, offset_m: float, reach_m: float
) -> tuple[Array, ...]:
    """The points, (3,) in the frame of at, m, that a ring of range finders around at sees.

    The distances d, (n,), m, are measured offset_m away from at, at angles_rad, (n,), to the left
    of the heading. A beam of at least reach_m met nothing.
    """
    angles = heading_rad + angles_rad
    beams = np.stack((np.cos(angles), np.sin(angles), np.zeros(len(d))), axis=1)
    points: Array = at + (d + offset_m)[:, None] * beams
    return tuple(points[d < reach_m])
