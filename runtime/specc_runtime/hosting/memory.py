"""The latest sample of every element in memory that the host writes and others read.

The file behind it has no name, so nothing of it stays, whoever ends first. It begins with the time
of the agent's last beat; an entry for every element follows, then the values. An entry has the
number of its newest sample and says of the last `DEPTH` of them where their bytes are. Sample n is
written in the place of sample n - DEPTH before the number is: a reader that copied bytes and finds
that the number has not grown by more than `DEPTH - 2` meanwhile has what was written. Nobody waits.
"""

from __future__ import annotations

import mmap
import os
import tempfile
from typing import NamedTuple

from specc_runtime.hosting.devices import DeviceError

DEPTH = 4
LARGEST = 1 << 28
"""Bytes of the largest value."""
_HEAD, _ENTRY = 8, 24  # in words of 8 bytes: a cache line, and three
_OFFSET, _LENGTH, _KIND, _TIME = range(4)
_SMALLEST = 256
_TRIES = 16


def anonymous_file() -> int:
    """A file without a name, in memory where the system has that; returns its descriptor."""
    if hasattr(os, "memfd_create"):
        return os.memfd_create("specc-devices")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


class Raw(NamedTuple):
    """A sample as it was written: its number from 1 on, time of measurement, kind and bytes."""

    number: int
    measured_s: float
    kind: int
    data: bytes


class _Mapped:
    """A mapping of the file. Words are read and written as one, which `struct` does not promise."""

    def __init__(self, file: int) -> None:
        self._map = mmap.mmap(file, 0)
        self.bytes = memoryview(self._map)
        whole = self.bytes[: len(self.bytes) // 8 * 8]
        self.words, self.times = whole.cast("Q"), whole.cast("d")

    def __len__(self) -> int:
        return len(self._map)


class Memory:
    """The memory of `count` elements, by their numbers."""

    def __init__(self, file: int, count: int) -> None:
        """Makes it if the file is empty."""
        self._file = file
        self._blocks: dict[int, tuple[int, int]] = {}
        if not os.fstat(file).st_size:
            os.ftruncate(file, 8 * (_HEAD + _ENTRY * count))
        self._mapped = _Mapped(file)

    @property
    def beat_s(self) -> float:
        """When the agent was heard last, by `time.monotonic()`; 0 if never."""
        return self._mapped.times[0]

    @beat_s.setter
    def beat_s(self, now_s: float) -> None:
        self._mapped.times[0] = now_s

    def number(self, index: int) -> int:
        """Of the newest sample of an element; 0 if there is none."""
        return self._mapped.words[_HEAD + _ENTRY * index]

    def read(self, index: int) -> Raw | None:
        """The newest sample of an element, if there is one and it could be read."""
        entry = _HEAD + _ENTRY * index
        for _ in range(_TRIES):
            words, number = self._mapped.words, self._mapped.words[entry]
            if not number:
                return None
            at = entry + 1 + 4 * (number % DEPTH)
            begin, length, kind = words[at + _OFFSET], words[at + _LENGTH], words[at + _KIND]
            if begin + length > len(self._mapped):
                if os.fstat(self._file).st_size < begin + length:
                    continue  # half of an entry that is being written
                self._mapped = _Mapped(self._file)
                continue
            time_s = self._mapped.times[at + _TIME]
            data = bytes(self._mapped.bytes[begin : begin + length])
            if words[entry] - number <= DEPTH - 2:
                return Raw(number, time_s, kind, data)
        return None

    def write(self, index: int, measured_s: float, kind: int, *parts: bytes | memoryview) -> None:
        """Put a sample there; raises `DeviceError` for one that is too large."""
        length = sum(len(part) for part in parts)
        if length > LARGEST:
            raise DeviceError(f"a value of {length} bytes, more than {LARGEST}")
        begin, room = self._blocks.get(index, (0, 0))
        if length > room:
            begin, room = self._blocks[index] = self._allocated(length)
        entry = _HEAD + _ENTRY * index
        number = self._mapped.words[entry] + 1
        begin += room * (number % DEPTH)
        words = self._mapped.words
        at = entry + 1 + 4 * (number % DEPTH)
        words[at + _OFFSET], words[at + _LENGTH], words[at + _KIND] = begin, length, kind
        self._mapped.times[at + _TIME] = measured_s
        for part in parts:
            self._put(part, begin)
            begin += len(part)
        words[entry] = number

    def _put(self, data: bytes | memoryview, begin: int) -> None:
        self._mapped.bytes[begin : begin + len(data)] = data

    def close(self) -> None:
        """Let go of the file; what was read stays."""
        os.close(self._file)

    def _allocated(self, length: int) -> tuple[int, int]:
        """Where there is new room for `DEPTH` samples, and how much for each."""
        begin, room = len(self._mapped), _SMALLEST
        while room < length:
            room *= 2
        try:
            if hasattr(os, "posix_fallocate"):  # no memory is an error here, and a signal later
                os.posix_fallocate(self._file, begin, DEPTH * room)
            os.ftruncate(self._file, begin + DEPTH * room)
        except OSError as error:
            raise DeviceError(f"no memory for a value of {length} bytes: {error}") from error
        self._mapped = _Mapped(self._file)
        return begin, room
