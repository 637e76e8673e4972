"""The pinhole camera of the Kinect: intrinsic parameters and both directions of projection.

K is the optical frame: x right, y down, z along the axis. Whole pixel numbers are pixel centres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from specc_runtime.operators.arrays import Array


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """P: focal lengths and principal point in pixels; no distortion."""

    fx: float
    fy: float
    cx: float
    cy: float


def kinect_intrinsics() -> Intrinsics:
    """The generic calibration of a 640 x 480 Kinect."""
    return Intrinsics(fx=525.0, fy=525.0, cx=319.5, cy=239.5)


def back_project(pixels: Array, depth_m: Array, P: Intrinsics) -> Array:
    """Points in K (n, 3) that lie at z = depth_m (n,) behind the pixels (n, 2)."""
    x = (pixels[:, 0] - P.cx) / P.fx
    y = (pixels[:, 1] - P.cy) / P.fy
    return np.stack([x * depth_m, y * depth_m, depth_m], axis=1)


def project(points: Array, P: Intrinsics) -> Array:
    """Pixels (n, 2) of points in K (n, 3) with z > 0."""
    u = P.fx * points[:, 0] / points[:, 2] + P.cx
    v = P.fy * points[:, 1] / points[:, 2] + P.cy
    return np.stack([u, v], axis=1)
