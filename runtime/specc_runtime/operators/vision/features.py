"""FE and IC: features of a picture and their places in space (eqs 44 and 45)."""

from __future__ import annotations

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.vision import opencv
from specc_runtime.operators.vision.camera import Intrinsics, back_project
from specc_runtime.operators.vision.region import textured_region
from specc_runtime.operators.vision.values import Depth, FeatureCloud, Features, Image

WINDOW_RADIUS_PX = 3
WINDOW_DEPTH_M = 0.010


def extract_features(I_rgb: Image) -> Features:
    """FE (eq. 44): the SIFT features of the textured part of an RGB picture (h, w, 3)."""
    gray = opencv.to_gray(I_rgb)
    rows, columns = textured_region(gray)
    points, descriptors = opencv.sift(gray[rows, columns])
    return Features(np.add(points, (columns.start, rows.start)), descriptors)


def to_cartesian(features: Features, I_depth: Depth, P: Intrinsics) -> FeatureCloud:
    """IC (eq. 45): the features with their places in K; those without a depth reading are left out.

    `I_depth` (h, w) is in metres, 0 where nothing was read.
    """
    depth = _depth_around(features.points, I_depth)
    known = depth > 0
    points = back_project(features.points[known], depth[known], P)
    to_camera = -points / np.linalg.norm(points, axis=1, keepdims=True)
    return FeatureCloud(points, to_camera, features.descriptors[known])


def _depth_around(pixels: Array, I_depth: Depth) -> Array:
    """Depth (n,) at pixels (n, 2): mean over the part of a window that lies on one surface.

    A single reading of a Kinect is off by several millimetres at 1.1 m; a feature is wider than
    the window. The surface is the one of the window's middle reading, so a step of depth beside
    the feature does no harm.
    """
    reach = np.arange(-WINDOW_RADIUS_PX, WINDOW_RADIUS_PX + 1)
    centre = np.rint(pixels).astype(np.int64)
    rows = np.clip(centre[:, 1, None] + reach, 0, I_depth.shape[0] - 1)
    columns = np.clip(centre[:, 0, None] + reach, 0, I_depth.shape[1] - 1)
    window = I_depth[rows[:, :, None], columns[:, None, :]].astype(np.float64)
    window = window.reshape(len(pixels), reach.size**2)
    middle = np.median(window, axis=1, keepdims=True)
    same_surface = (np.abs(window - middle) < WINDOW_DEPTH_M) & (window > 0)
    count = same_surface.sum(axis=1)
    total = np.where(same_surface, window, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), 0.0)
