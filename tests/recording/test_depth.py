"""Depth maps of exact recordings come back bit for bit."""

from __future__ import annotations

import random
import struct
from typing import Any

import numpy as np
import pytest
from specc_runtime.forms import Misshapen
from specc_runtime.recording.depth import DepthCoder, read_depth

SHAPE = 12, 17


def _maps() -> list[np.ndarray[Any, Any]]:
    chance = np.random.default_rng(0)
    few = (300.0 / np.arange(200, 260)).astype(np.float32)
    maps = [few[chance.integers(0, n, SHAPE)] for n in (3, 60, 60, 1)]
    maps.append(chance.normal(size=(300, 200)).astype(np.float32))
    odd = np.array([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-45, 3e38, 1.0], np.float32)
    maps.append(odd[chance.integers(0, len(odd), SHAPE)])
    maps.append(chance.integers(0, 2**32, SHAPE, dtype=np.uint32).view(np.float32))
    maps.append(np.asfortranarray(few[chance.integers(0, 60, SHAPE)]))
    return [*maps, *reversed(maps)]


def test_depth_maps_come_back() -> None:
    coder = DepthCoder()
    for image in _maps():
        message = coder.message(image, 0.0, "")
        again = read_depth(message)
        assert again.shape == image.shape and again.dtype == np.float32
        assert again.tobytes() == image.tobytes()
        assert not again.flags.writeable


def test_few_distances_take_two_bytes_each() -> None:
    coder, image = DepthCoder(), _maps()[1]
    for shift in range(5):  # with some that are new, and some that are gone
        distances = np.unique(image + np.float32(shift / 8))
        message = coder.message(image + np.float32(shift / 8), 0.0, "")
        assert len(message) <= 12 + 4 * 60 * (shift + 1) + 2 * image.size
        assert len(distances) <= 60


def test_what_is_no_depth_map_is_told() -> None:
    chance, whole = random.Random(0), DepthCoder().message(_maps()[1], 0.0, "")
    forged = [
        b"",
        bytes(12),
        struct.pack("<III", 2**31, 2**31, 1) + bytes(6),
        whole[:-1],
        whole[:40],
    ]
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(chance.choice((1, 3))):
            data[chance.randrange(chance.choice((12, len(data))))] = chance.randrange(256)
        forged.append(bytes(data))
    told = 0
    for message in forged:
        try:
            read_depth(message)
        except Misshapen:
            told += 1
    assert told > 100
    with pytest.raises(Misshapen):
        read_depth(whole[:-1])
