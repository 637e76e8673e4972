"""Textures are sampled as OpenGL does it."""

import numpy as np
import pytest
from specc_runtime.plants.mujoco.texture import pyramid, sample


@pytest.fixture
def image():
    return np.random.default_rng(0).integers(0, 256, (64, 48, 3), dtype=np.uint8)


def centres(height, width):
    v, u = np.mgrid[0:height, 0:width]
    return np.stack(((u + 0.5) / width, (v + 0.5) / height), axis=-1).reshape(-1, 2)


def test_levels_halve_down_to_one_texel(image):
    shapes = [level.shape[:2] for level in pyramid(image)]
    assert shapes == [(64, 48), (32, 24), (16, 12), (8, 6), (4, 3), (2, 1), (1, 1)]


def test_levels_of_even_size_keep_the_mean(image):
    levels = pyramid(image)
    for level in levels[:4]:
        assert level.mean(axis=(0, 1)) == pytest.approx(image.mean(axis=(0, 1)), rel=1e-5)


def test_a_centre_of_a_texel_has_its_colour(image):
    colours = sample(pyramid(image), centres(64, 48).astype(np.float32), np.ones(64 * 48))
    assert colours.reshape(64, 48, 3) == pytest.approx(image.astype(float), abs=0.02)


def test_a_large_footprint_sees_the_level_of_its_size(image):
    levels = pyramid(image)
    uv = centres(16, 12).astype(np.float32)
    assert sample(levels, uv, np.full(len(uv), 4.0)) == pytest.approx(
        levels[2].reshape(-1, 3), abs=0.01
    )
    between = sample(levels, uv, np.full(len(uv), 4.0 * np.sqrt(2)))
    coarse = sample(levels, uv, np.full(len(uv), 8.0))
    assert between == pytest.approx((levels[2].reshape(-1, 3) + coarse) / 2, abs=0.01)


def test_it_repeats(image):
    levels = pyramid(image)
    uv = np.random.default_rng(1).uniform(0, 1, (50, 2)).astype(np.float32)
    once, shifted = (sample(levels, uv + offset, np.ones(50)) for offset in (0, (2, -3)))
    assert once == pytest.approx(shifted, abs=0.05)
