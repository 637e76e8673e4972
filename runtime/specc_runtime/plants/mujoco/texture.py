"""Textures sampled as OpenGL samples them: repeated, bilinear, between two levels of a pyramid."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]


def pyramid(image: NDArray[np.uint8]) -> tuple[Image, ...]:
    """Levels of an (h, w, 3) image, each half as large as the one before, down to one texel."""
    levels = [image.astype(np.float32)]
    while max(levels[-1].shape[:2]) > 1:
        halved = _halve(levels[-1], axis=0)
        levels.append(_halve(halved, axis=1))
    return tuple(levels)


def _halve(image: Image, axis: int) -> Image:
    """Linear interpolation at the centres of the new texels; the mean of two where size is even."""
    size = image.shape[axis]
    if size == 1:
        return image
    half = size // 2
    centre = (np.arange(half) + 0.5) * (size / half) - 0.5
    low = centre.astype(np.intp)
    shape = [1, 1, 1]
    shape[axis] = half
    weight = (centre - low).astype(np.float32).reshape(shape)
    high = np.minimum(low + 1, size - 1)
    halved: Image = image.take(low, axis) * (1 - weight) + image.take(high, axis) * weight
    return halved


def sample(levels: Sequence[Image], uv: Image, footprint: NDArray[np.float32]) -> Image:
    """Colours (n, 3), 0..255, at texture coordinates.

    Args:
        levels: what `pyramid` returns.
        uv: (n, 2), in [0, 1) over the image from its first row and column; repeats outside.
        footprint: (n,) length that one pixel covers on the texture, in texels of level 0.
    """
    level = np.clip(np.log2(np.maximum(footprint, 1e-6)), 0, len(levels) - 1)
    low = level.astype(np.intp)
    blend = (level - low).astype(np.float32)[:, None]
    colours = np.empty((len(uv), 3), np.float32)
    for k in np.unique(low):
        chosen = np.flatnonzero(low == k)
        fine = _bilinear(levels[k], uv[chosen])
        coarse = _bilinear(levels[min(k + 1, len(levels) - 1)], uv[chosen])
        colours[chosen] = fine + blend[chosen] * (coarse - fine)
    return colours


def _bilinear(image: Image, uv: Image) -> Image:
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    across, down = (x - column).astype(np.float32)[:, None], (y - row).astype(np.float32)[:, None]
    left, right = column % width, (column + 1) % width
    upper, lower = row % height, (row + 1) % height
    above = image[upper, left] * (1 - across) + image[upper, right] * across
    below = image[lower, left] * (1 - across) + image[lower, right] * across
    mixed: Image = above * (1 - down) + below * down
    return mixed
