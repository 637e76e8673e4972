"""Where a picture has texture, as opposed to plain surfaces and their edges.

SIFT on a whole picture spends nearly all of its time on the table and the arm, which have no
features that match a model.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.vision.values import Image

BLOCK_PX = 16
# Grey levels between a pixel's two neighbours.
MIN_GRADIENT = 20
# A straight edge through a block takes an eighth of its pixels, a texture nearly all.
MIN_DENSITY = 0.45
# What the largest features of interest need around them.
MARGIN_PX = 32


def textured_region(gray: Image) -> tuple[slice, slice]:
    """Rows and columns of the smallest rectangle around all textured blocks, with a margin.

    Both slices are empty if nothing in the picture (h, w) is textured.
    """
    rows, columns = np.nonzero(_gradient_density(gray) >= MIN_DENSITY)
    if rows.size == 0:
        return slice(0, 0), slice(0, 0)
    return _span(rows, gray.shape[0]), _span(columns, gray.shape[1])


def _gradient_density(gray: Image) -> Array:
    """Part of the pixels of each whole block that have a gradient across or along the rows."""
    steep = np.zeros(gray.shape, bool)
    steep[:, 1:-1] |= _differ(gray[:, 2:], gray[:, :-2])
    steep[1:-1] |= _differ(gray[2:], gray[:-2])
    down, across = (side // BLOCK_PX for side in gray.shape)
    blocks = steep[: down * BLOCK_PX, : across * BLOCK_PX]
    density: Array = blocks.reshape(down, BLOCK_PX, across, BLOCK_PX).mean(axis=(1, 3))
    return density


def _differ(one: Image, other: Image) -> NDArray[np.bool_]:
    # Bytes have no sign: the larger one comes first.
    difference = np.maximum(one, other) - np.minimum(one, other)
    steep: NDArray[np.bool_] = difference > MIN_GRADIENT
    return steep


def _span(blocks: NDArray[np.int64], end: int) -> slice:
    first = int(blocks.min()) * BLOCK_PX - MARGIN_PX
    last = (int(blocks.max()) + 1) * BLOCK_PX + MARGIN_PX
    return slice(max(0, first), min(end, last))
