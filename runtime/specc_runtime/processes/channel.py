"""Messages between two processes: a socket, and memory of both for what is large.

The memory has no name in the file system: the kernel frees it with the last of the two processes,
however they end. Each end writes to a block of its own, and asks for an answer before it writes
again, so that nobody reads what is being changed. What is read is copied, since blocks are used
again.
"""

from __future__ import annotations

import mmap
import os
import pickle
import select
import socket
import struct
from typing import Any

LARGE_BYTES = 4096
"""Arrays from this size on go through the memory."""
INLINE_BYTES = 32_768
"""Of a message that goes through the socket."""
_PAGE = mmap.PAGESIZE
_INLINE, _BLOCK = b"i", b"b"
_LENGTH = struct.Struct("<Q")
_ALIGNED = 64


class Gone(Exception):
    """The process at the other end has ended."""


class Block:
    """Memory of two processes that grows; every page of it is mapped when it is made."""

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self._map()

    @classmethod
    def of_bytes(cls, size: int) -> Block:
        """New memory, which another process has by its descriptor."""
        descriptor = os.memfd_create("specc")
        os.ftruncate(descriptor, _pages(size))
        return cls(descriptor)

    def _map(self) -> None:
        self.size = os.fstat(self.descriptor).st_size
        flags = mmap.MAP_SHARED | getattr(mmap, "MAP_POPULATE", 0)
        self.memory = mmap.mmap(self.descriptor, self.size, flags=flags)

    def hold(self, size: int) -> None:
        """Be at least that large, whoever of the two made it grow."""
        if size > self.size:
            if size > os.fstat(self.descriptor).st_size:
                os.ftruncate(self.descriptor, _pages(2 * size))
            self.memory.close()
            self._map()

    def close(self) -> None:
        """Give it up; the other process may still have it."""
        self.memory.close()
        os.close(self.descriptor)


class Channel:
    """One end of the connection. Any values that can be pickled cross, arrays bit for bit."""

    def __init__(self, end: socket.socket, written: Block, read: Block) -> None:
        self._socket = end
        self._written, self._read = written, read
        self._poll = select.poll()
        self._poll.register(end, select.POLLIN)

    def send(self, message: Any) -> None:
        """Raises Gone, and what pickling raises."""
        large: list[memoryview] = []

        def is_small(buffer: pickle.PickleBuffer) -> bool:
            raw = buffer.raw()
            if raw.nbytes < LARGE_BYTES:
                return True
            large.append(raw)
            return False

        stream = pickle.dumps(message, 5, buffer_callback=is_small)
        if large or len(stream) > INLINE_BYTES:
            packet = _BLOCK + _LENGTH.pack(self._put((stream, *large)))
        else:
            packet = _INLINE + stream
        try:
            self._socket.send(packet)
        except ConnectionError:
            raise Gone from None

    def _put(self, parts: tuple[bytes | memoryview, ...]) -> int:
        """Write the parts after a table of their lengths; returns where they end."""
        lengths = [memoryview(part).nbytes for part in parts]
        table = b"".join(map(_LENGTH.pack, (len(parts), *lengths)))
        ends = _ends(len(table), lengths)
        self._written.hold(ends[-1])
        memory = self._written.memory
        memory[: len(table)] = table
        for part, length, end in zip(parts, lengths, ends, strict=True):
            memory[end - length : end] = part
        return ends[-1]

    def receive(self) -> Any:
        """The next message, waited for. Raises Gone, and what unpickling raises."""
        try:
            packet = self._socket.recv(2 * INLINE_BYTES)
        except ConnectionError:
            packet = b""
        if not packet:
            raise Gone
        kind, rest = packet[:1], packet[1:]
        if kind == _INLINE:
            return pickle.loads(rest)
        stream, *large = self._get(*_LENGTH.unpack(rest))
        return pickle.loads(stream, buffers=large)

    def _get(self, size: int) -> list[bytes]:
        self._read.hold(size)
        memory = self._read.memory
        width = _LENGTH.size
        (count,) = _LENGTH.unpack(memory[:width])
        table = memory[width : (1 + count) * width]
        lengths = [length for (length,) in _LENGTH.iter_unpack(table)]
        ends = _ends((1 + count) * width, lengths)
        return [memory[end - n : end] for n, end in zip(lengths, ends, strict=True)]

    @property
    def is_answered(self) -> bool:
        """Whether a message is there, or the other end is gone: `receive` does not wait."""
        return bool(self._poll.poll(0))

    def close(self) -> None:
        """Give it up; the other end finds that out."""
        self._socket.close()
        self._written.close()
        self._read.close()


def _ends(begin: int, lengths: list[int]) -> list[int]:
    """Where parts of these lengths end that begin at multiples of a cache line."""
    ends = []
    for length in lengths:
        begin = -(-begin // _ALIGNED) * _ALIGNED + length
        ends.append(begin)
    return ends


def _pages(size: int) -> int:
    return max(1, -(-size // _PAGE)) * _PAGE
