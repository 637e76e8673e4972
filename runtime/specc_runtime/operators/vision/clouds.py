"""Clouds, models and objects in another frame."""

from __future__ import annotations

from dataclasses import replace

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.vision.values import Cloud, FeatureCloud


def move_points(X_AB: Array, points: Array) -> Array:
    """Points of B (n, 3) in A, for X_AB (4, 4)."""
    moved: Array = points @ X_AB[:3, :3].T + X_AB[:3, 3]
    return moved


def move_cloud(X_AB: Array, cloud: Cloud) -> Cloud:
    """The coloured cloud, known in B, in A."""
    return replace(cloud, points=move_points(X_AB, cloud.points))


def move_feature_cloud(X_AB: Array, cloud: FeatureCloud) -> FeatureCloud:
    """The feature cloud, known in B, in A; the descriptors are shared."""
    seen_from: Array = cloud.seen_from @ X_AB[:3, :3].T
    return replace(cloud, points=move_points(X_AB, cloud.points), seen_from=seen_from)
