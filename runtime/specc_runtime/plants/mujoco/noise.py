"""Noise of sensors. Every binding, and every image of a camera, has a random stream of its own."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array

KINECT_SIGMA_PER_M = 1.425e-3  # sigma = this * z^2
KINECT_STEP_PER_M = 2.7e-3  # step of the reading = this * z^2
_BLOCK = 256


def gaussian(rng: np.random.Generator, sigma: Array) -> Iterator[Array]:
    """Endless independent noise with standard deviations sigma (n,), drawn in blocks: it is cheaper
    and, of one stream, the same.
    """
    while True:
        yield from sigma * rng.standard_normal((_BLOCK, sigma.size))


def grain(rng: np.random.Generator, size: tuple[int, int]) -> NDArray[np.float32]:
    """Independent Gaussian noise of unit variance for each pixel of an image (h, w)."""
    return rng.standard_normal(size, dtype=np.float32)


def kinect_depth(depth: NDArray[np.float32], grain: NDArray[np.float32]) -> NDArray[np.float32]:
    """Depth image (h, w) with the noise of a structured-light camera; 0 (no reading) stays 0.

    Gaussian with sigma = 1.425e-3 z^2 (z in m), then rounded to whole steps of disparity, which is
    proportional to 1/z: steps of 2.7e-3 z^2.
    """
    with np.errstate(divide="ignore"):  # no reading is an infinite disparity, here and at the end
        noisy = np.reciprocal(np.abs(depth))
    # d(1/z) = dz / z^2: in disparity both sigma and step are the same at all distances.
    noisy += np.float32(KINECT_SIGMA_PER_M) * grain
    noisy /= np.float32(KINECT_STEP_PER_M)
    np.maximum(np.rint(noisy, out=noisy), 1, out=noisy)
    return np.divide(np.float32(1 / KINECT_STEP_PER_M), noisy, out=noisy)
