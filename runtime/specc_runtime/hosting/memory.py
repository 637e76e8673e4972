"""The latest sample of every element in memory that the host writes and others read.

It begins with the time of the agent's last beat; an entry for every element follows, then the bytes
of samples. An entry has the number of its newest sample and `SLOTS` places for samples. Who reads
one pins its place: the host writes no other sample there until that is taken back, so that the
agent, and processes that it tells of the place, have the bytes as they are for as long as they
like. Nobody waits: the host takes a place that is free. Only the agent pins, so no two processes
write the same word.
"""

from __future__ import annotations

import threading
from collections import Counter, deque
from typing import NamedTuple

from specc_runtime.blocks import Block
from specc_runtime.hosting.devices import DeviceError

SLOTS = 8
MOST_PINNED = SLOTS - 3
"""Samples of an element that may stay pinned: others are the newest, the next, and one is read."""
LARGEST = 1 << 28
"""Bytes of the largest value."""
_HEAD, _PLACE = 8, 8  # in words of 8 bytes: a cache line each
_ENTRY = _PLACE * (1 + SLOTS)
_NUMBER, _BEGIN, _LENGTH, _KIND, _TIME, _PIN = range(6)
_SMALLEST = 256
_TRIES = 64


class Extent(NamedTuple):
    """Where the bytes of a sample are, and of which kind they are."""

    begin: int
    length: int
    kind: int


class Raw:
    """A sample as it was written: its number from 1 on and time of measurement.

    `data` are its bytes in the memory, which stay as they are as long as this object is there. Who
    has the memory by its `descriptor` finds them at `extent`.
    """

    __slots__ = ("_at", "_dropped", "data", "descriptor", "extent", "measured_s", "number")

    def __init__(self, memory: Memory, at: int, dropped: deque[int]) -> None:
        words = memory.block.words
        self._at, self._dropped = at, dropped
        self.number = words[at + _NUMBER]
        self.measured_s = memory.block.times[at + _TIME]
        self.extent = Extent(words[at + _BEGIN], words[at + _LENGTH], words[at + _KIND])
        self.data = memory.part(self.extent)
        self.descriptor = memory.block.descriptor

    def __del__(self) -> None:
        self._dropped.append(self._at)  # whichever thread this is: `read` takes the pin back


class Memory:
    """The memory of `count` elements, by their numbers. One thread of the agent reads."""

    def __init__(self, block: Block, count: int) -> None:
        """`block` has at least `size(count)` bytes."""
        self.block = block
        self._end = self.size(count)
        self._rooms: list[list[tuple[int, int]]] = [[] for _ in range(count)]
        """Of each element and place that the host has used: where its bytes begin, and how many."""
        self._pins: Counter[int] = Counter()
        self._dropped: deque[int] = deque()
        self._lock = threading.Lock()

    @staticmethod
    def size(count: int) -> int:
        """Bytes for so many elements without their samples."""
        return 8 * (_HEAD + _ENTRY * count)

    @property
    def beat_s(self) -> float:
        """When the agent was heard last, by `time.monotonic()`; 0 if never."""
        return self.block.times[0]

    @beat_s.setter
    def beat_s(self, now_s: float) -> None:
        self.block.times[0] = now_s

    def number(self, index: int) -> int:
        """Of the newest sample of an element; 0 if there is none."""
        return self.block.words[_HEAD + _ENTRY * index] // SLOTS

    def pinned(self, index: int) -> int:
        """How many samples of an element are pinned."""
        return sum(self._pins[_place(index, slot)] > 0 for slot in range(SLOTS))

    def read(self, index: int) -> Raw | None:
        """The newest sample of an element, if there is one and it could be read."""
        words = self.block.words
        for _ in range(_TRIES):
            self._take_back()
            number, slot = divmod(words[_HEAD + _ENTRY * index], SLOTS)
            if not number:
                return None
            at = _place(index, slot)
            self._pins[at] += 1
            words[at + _PIN] = 1
            self._fence()
            if words[at + _NUMBER] == number:
                return Raw(self, at, self._dropped)
            self._dropped.append(at)  # the host was about to write there
        return None

    def part(self, extent: Extent) -> memoryview:
        """The bytes there."""
        end = extent.begin + extent.length
        self.block.hold(end)
        return self.block.bytes[extent.begin : end].toreadonly()

    def _take_back(self) -> None:
        while self._dropped:
            at = self._dropped.popleft()
            self._pins[at] -= 1
            if not self._pins[at]:
                self.block.words[at + _PIN] = 0

    def write(self, index: int, measured_s: float, kind: int, *parts: bytes | memoryview) -> None:
        """Put a sample there; raises `DeviceError` for one that is too large."""
        length = sum(len(part) for part in parts)
        if length > LARGEST:
            raise DeviceError(f"a value of {length} bytes, more than {LARGEST}")
        slot = self._free(index)
        begin = self._room(index, slot, length)
        words, entry, at = self.block.words, _HEAD + _ENTRY * index, _place(index, slot)
        words[at + _BEGIN], words[at + _LENGTH], words[at + _KIND] = begin, length, kind
        self.block.times[at + _TIME] = measured_s
        for part in parts:
            self._put(part, begin)
            begin += len(part)
        number = words[entry] // SLOTS + 1
        words[at + _NUMBER] = number
        words[entry] = number * SLOTS + slot

    def _put(self, data: bytes | memoryview, begin: int) -> None:
        self.block.bytes[begin : begin + len(data)] = data

    def _free(self, index: int) -> int:
        """A place that is neither the newest sample's nor pinned, one with bytes of its own first.

        Whoever pins it from now on finds that its sample is gone.
        """
        words, used = self.block.words, len(self._rooms[index])
        newest = words[_HEAD + _ENTRY * index] % SLOTS
        for n in range(1, used):
            slot = (newest + n) % used
            at = _place(index, slot)
            if not words[at + _PIN]:
                number, words[at + _NUMBER] = words[at + _NUMBER], 0
                self._fence()
                if not words[at + _PIN]:
                    return slot
                words[at + _NUMBER] = number
        if used == SLOTS:
            raise DeviceError("all the memory of this element is in use")
        self._rooms[index].append((0, 0))
        return used

    def _fence(self) -> None:
        """What this thread has written is seen by others before it reads on.

        Agent and host each write a word and look whether the other has written its own.
        """
        with self._lock:  # an atomic operation, which processors do not put off
            pass

    def _room(self, index: int, slot: int, length: int) -> int:
        """Where there is room for so many bytes."""
        begin, room = self._rooms[index][slot]
        if length > room:
            begin, room = self._end, _SMALLEST
            while room < length:
                room *= 2
            try:
                self.block.hold(begin + room)
            except OSError as error:
                message = f"no memory for a value of {length} bytes: {error}"
                raise DeviceError(message) from error
            self._rooms[index][slot] = begin, room
            self._end = begin + room
        return begin

    def close(self) -> None:
        """Let go of the memory; what was read stays."""
        self.block.close()


def _place(index: int, slot: int) -> int:
    """The word at which a place of an element begins."""
    return _HEAD + _ENTRY * index + _PLACE * (1 + slot)
