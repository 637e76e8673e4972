"""Noise of the depth camera, and random streams."""

import numpy as np
import pytest
from specc_runtime.plants.mujoco.noise import grain, kinect_depth
from specc_runtime.random_streams import stream


@pytest.mark.parametrize("z", [0.6, 1.1, 2.0])
def test_depth_noise_grows_with_the_square_of_distance(z):
    depth = np.full((200, 200), z, np.float32)
    noisy = kinect_depth(depth, grain(np.random.default_rng(0), depth.shape))
    sigma, step = 1.425e-3 * z**2, 2.7e-3 * z**2
    # Rounding of a value noisy over half a step adds the variance of an equal distribution.
    assert np.std(noisy - depth) == pytest.approx(np.hypot(sigma, step / np.sqrt(12)), rel=0.03)
    assert np.mean(noisy) == pytest.approx(z, abs=0.1 * sigma)
    assert np.diff(np.unique(noisy)) == pytest.approx(step, rel=0.05)
    assert noisy.dtype == np.float32


def test_no_reading_stays_no_reading():
    depth = np.zeros((4, 5), np.float32)
    depth[1, 2] = 1.0
    noisy = kinect_depth(depth, grain(np.random.default_rng(0), depth.shape))
    assert np.array_equal(noisy == 0, depth == 0)


def test_the_image_is_not_changed():
    depth = np.ones((4, 5), np.float32)
    depth.flags.writeable = False
    kinect_depth(depth, grain(np.random.default_rng(0), depth.shape))
    assert np.all(depth == 1)


def test_streams_differ_by_seed_and_by_name():
    draws = {stream(seed, name).random() for seed in (0, 1) for name in ("a", "b", "ab")}
    assert len(draws) == 6
    assert stream(1, "a").random() == stream(1, "a").random()
