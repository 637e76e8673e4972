"""Lossless coding of depth maps by a palette: most sensors give few different distances.

A message is binary: width, height and the number of distances (32-bit integers), the distances
(32-bit floats), then for each pixel the index of its distance, first all low bytes, then all high
bytes. With 0 distances it has the pixels themselves: all first bytes, all second bytes, and so on.
The chunk compresses the message to less than half the size of the compressed floats.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from specc_runtime.forms import Misshapen

DEPTH, ENCODING = "specc.DepthImage", "x-specc-depth"
_HEAD = struct.Struct("<III")
_MOST = 1 << 13
"""Distances of a palette; with more, the pixels themselves are written."""
_MOST_CELLS = 1 << 22

Image = np.ndarray[Any, Any]
_Bits = np.ndarray[Any, np.dtype[np.uint32]]


class DepthCoder:
    """Writes the depth maps of an element; the palette is kept, since most distances recur."""

    def __init__(self) -> None:
        self._known: _Bits = np.zeros(0, np.uint32)
        self._shift = 0
        self._cells = np.zeros(1, np.uint16)
        """Lookup table: index of a distance by its higher bits, counted from the first distance."""

    def message(self, image: Image, time_s: float, frame: str) -> bytes:
        """The message of a depth map (h, w) of 32-bit floats in m."""
        bits = np.ascontiguousarray(image, "<f4").view(np.uint32).ravel()
        numbers = self._numbers(bits)
        if numbers is None:
            known, planes = b"", _planes(bits, 4)
        else:
            known, planes = self._known.tobytes(), _planes(numbers, 2)
        return _HEAD.pack(image.shape[1], image.shape[0], len(known) // 4) + known + planes

    def _numbers(self, bits: _Bits) -> Any:
        """The index of the distance of each pixel; None if there are too many distances."""
        numbers, is_right = self._found(bits)
        if is_right.all():
            return numbers
        new = bits[~is_right]
        for known in (self._known, new[:0]):  # second try without old distances
            known = np.union1d(known, np.unique(new if len(known) else bits))
            if len(known) <= _MOST:
                self._learn(known)
                numbers, is_right = self._found(bits)
                return numbers if is_right.all() else None
        return None

    def _learn(self, known: _Bits) -> None:
        """Lay out a table with at most one distance in each cell."""
        self._known = known
        step = int(np.diff(known).min()) if len(known) > 1 else 1
        self._shift = step.bit_length() - 1
        cells = (known - known[0]) >> self._shift
        if int(cells[-1]) >= _MOST_CELLS:
            self._cells = np.zeros(1, np.uint16)
            return
        self._cells = np.zeros(int(cells[-1]) + 1, np.uint16)
        self._cells[cells] = np.arange(len(known), dtype=np.uint16)

    def _found(self, bits: _Bits) -> tuple[Any, Any]:
        """For each pixel the index of a distance, and whether it is the right one."""
        if not len(self._known):
            return bits, np.zeros(len(bits), bool)
        cells = (bits - self._known[0]) >> self._shift
        numbers = self._cells[np.minimum(cells, len(self._cells) - 1)]
        return numbers, self._known[numbers] == bits


def read_depth(message: bytes) -> Image:
    """The depth map of a message, read-only; raises Misshapen."""
    try:
        width, height, count = _HEAD.unpack_from(message)
        begin = _HEAD.size + 4 * count
        planes = np.frombuffer(message, np.uint8, offset=begin).reshape(2 if count else 4, -1)
        bits = np.ascontiguousarray(planes.T).view("<u2" if count else "<u4").ravel()
        if count:
            bits = np.frombuffer(message, "<u4", count, _HEAD.size)[bits]
        image = bits.view(np.float32).reshape(height, width)
    except (struct.error, ValueError, IndexError, ArithmeticError) as error:
        raise Misshapen(f"no depth map: {error}") from None
    image.setflags(write=False)
    return image


def _planes(values: Any, size: int) -> bytes:
    """The first bytes of all values, then the second bytes, and so on."""
    of = np.ascontiguousarray(values, f"<u{size}").view(np.uint8).reshape(-1, size)
    return np.ascontiguousarray(of.T).tobytes()
