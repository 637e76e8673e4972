"""Noise of sensors. Every binding, and every image of a camera, has a random stream of its own."""

import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array

KINECT_SIGMA_PER_M = 1.425e-3  # sigma = this * z^2
KINECT_STEP_PER_M = 2.7e-3  # step of the reading = this * z^2


def stream(seed: int, name: str, *sample: int) -> np.random.Generator:
    """Random stream of the binding `name`, or of one sample of it, in the run with that seed.

    It depends on nothing else, so neither the other bindings nor the order of sampling matter. A
    sample is named by its number since the beginning of the run.
    """
    entropy = [seed, zlib.crc32(name.encode())]
    return np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=sample))


def standard_deviations(noise: Sequence[float], sizes: Sequence[int]) -> Array:
    """One standard deviation per number: noise[i] for the sizes[i] numbers of sensor i."""
    return np.repeat(np.asarray(noise, dtype=float), sizes)


def kinect_depth(depth: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """Depth image with the noise of a structured-light camera; 0 (no reading) stays 0.

    Gaussian with sigma = 1.425e-3 z^2 (z in m), then rounded to whole steps of disparity, which is
    proportional to 1/z: steps of 2.7e-3 z^2. The noise of neighbouring pixels is independent.
    """
    missing = depth == 0
    disparity = 1.0 / np.where(missing, np.float32(1), depth)
    # d(1/z) = dz / z^2: in disparity both sigma and step are the same at all distances.
    noise = rng.standard_normal(depth.shape, dtype=np.float32)
    disparity += np.float32(KINECT_SIGMA_PER_M) * noise
    steps = np.maximum(np.rint(disparity / np.float32(KINECT_STEP_PER_M)), 1)
    noisy = np.float32(1 / KINECT_STEP_PER_M) / steps
    noisy[missing] = 0
    return noisy.astype(np.float32, copy=False)
