"""The door to OpenCV: reading and resizing pictures, SIFT, and nearest neighbours by FLANN.

OpenCV runs on one thread here. Its SIFT gains nothing from a second one, and the vision worker
shares the machine with the control loops.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array

Image = NDArray[np.uint8]
Descriptors = NDArray[np.float32]

CONTRAST_THRESHOLD = 0.02
FLANN_INDEX_KDTREE = 1
FLANN_TREES = 4
FLANN_CHECKS = 32
FLANN_SEED = 1

cv2.setNumThreads(1)


def read_rgb(path: str) -> Image:
    """The picture at `path`, (h, w, 3) RGB. Raises OSError if it cannot be read."""
    bgr = cv2.imread(path, cv2.IMREAD_COLOR)
    if bgr is None:
        raise OSError(f"cannot read the picture {path}")
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), np.uint8)


def resize(picture: Image, width_px: int, height_px: int) -> Image:
    """The picture at a smaller size, each pixel the mean of the area it covers."""
    smaller = cv2.resize(picture, (width_px, height_px), interpolation=cv2.INTER_AREA)
    return np.asarray(smaller, np.uint8)


def to_gray(rgb: Image) -> Image:
    """Luminance (h, w) of an RGB picture (h, w, 3)."""
    return np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8)


def sift(gray: Image) -> tuple[Array, Descriptors]:
    """SIFT keypoints (n, 2) as (u, v), whole numbers at pixel centres, and descriptors (n, 128).

    The precise upscaling removes a bias of the default detector of 0.15 pixel in u and v.
    """
    if gray.size == 0:
        return np.empty((0, 2)), np.empty((0, 128), np.float32)
    detector = cv2.SIFT.create(contrastThreshold=CONTRAST_THRESHOLD, enable_precise_upscale=True)
    keypoints, descriptors = detector.detectAndCompute(gray, None)
    if not keypoints:
        return np.empty((0, 2)), np.empty((0, 128), np.float32)
    return np.array([point.pt for point in keypoints]), np.asarray(descriptors, np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class NeighbourIndex:
    """A trained FLANN index over n descriptors; opaque outside this module."""

    matcher: cv2.FlannBasedMatcher


def train(descriptors: Descriptors) -> NeighbourIndex:
    """Randomised k-d trees over the descriptors (n, 128), the same ones in every call.

    The trees take their chance from the thread's generator, which is therefore seeded first.
    """
    cv2.setRNGSeed(FLANN_SEED)
    matcher = cv2.FlannBasedMatcher(
        {"algorithm": FLANN_INDEX_KDTREE, "trees": FLANN_TREES}, {"checks": FLANN_CHECKS}
    )
    matcher.add([descriptors])
    matcher.train()
    return NeighbourIndex(matcher)


def nearest(
    index: NeighbourIndex, queries: Descriptors, count: int
) -> tuple[NDArray[np.int64], Array]:
    """The `count` nearest neighbours of each query (m, 128): rows in the index and distances.

    Both are (m, count), nearest first.
    """
    if len(queries) == 0:
        return np.empty((0, count), np.int64), np.empty((0, count))
    found = index.matcher.knnMatch(queries, count)
    rows = np.array([[match.trainIdx for match in matches] for matches in found], np.int64)
    distances = np.array([[match.distance for match in matches] for matches in found])
    return rows, distances
