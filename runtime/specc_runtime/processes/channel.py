"""Messages between two processes: a socket, and memory of both for what is large.

Each end writes to a block of its own, and asks for an answer before it writes again, so that nobody
reads what is being changed. What is read is copied, since blocks are used again.
"""

from __future__ import annotations

import os
import pickle
import select
import socket
import struct
from typing import Any

from specc_runtime.blocks import Block

LARGE_BYTES = 4096
"""Arrays from this size on go through the memory."""
LARGEST_BYTES = 1 << 28
"""Of one message: as much as the largest value of a device has."""
INLINE_BYTES = 32_768
"""Of a message that goes through the socket."""
_INLINE, _BLOCK = b"i", b"b"
_FLAGS = getattr(socket, "MSG_CMSG_CLOEXEC", 0)
_LENGTH = struct.Struct("<Q")
_ALIGNED = 64


class Gone(Exception):
    """The process at the other end has ended."""


class Garbled(Exception):
    """What came is no message: something else has written to the socket."""


class TooLarge(Exception):
    """A message has more bytes than may cross, or than there is memory for."""


class ProcessChannel:
    """One end of the connection. Any values that can be pickled cross, arrays bit for bit."""

    def __init__(self, end: socket.socket, written: Block, read: Block) -> None:
        self._socket = end
        self._written, self._read = written, read
        self._poll = select.poll()
        self._poll.register(end, select.POLLIN)
        self.descriptors: list[int] = []
        """What came beside messages: whoever takes one out closes it."""

    def send(self, message: Any, *descriptors: int) -> None:
        """Send a message, and files beside it.

        Raises Gone, and what pickling raises; TooLarge, and then nothing was sent.
        """
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
            socket.send_fds(self._socket, [packet], descriptors)
        except ConnectionError:
            raise Gone from None

    def _put(self, parts: tuple[bytes | memoryview, ...]) -> int:
        """Write the parts after a table of their lengths; returns where they end."""
        lengths = [memoryview(part).nbytes for part in parts]
        table = b"".join(map(_LENGTH.pack, (len(parts), *lengths)))
        ends = _ends(len(table), lengths)
        if ends[-1] > LARGEST_BYTES:
            raise TooLarge(f"{_mb(ends[-1])}, and at most {_mb(LARGEST_BYTES)} may cross at once")
        try:
            self._written.hold(ends[-1], min(2 * ends[-1], LARGEST_BYTES))
        except OSError as error:
            raise TooLarge(f"{_mb(ends[-1])}: {error.strerror or error}") from error
        memory = self._written.bytes
        memory[: len(table)] = table
        for part, length, end in zip(parts, lengths, ends, strict=True):
            memory[end - length : end] = part
        return ends[-1]

    def receive(self) -> Any:
        """The next message, waited for. Raises Gone, Garbled."""
        try:
            packet, descriptors, *_ = socket.recv_fds(self._socket, 2 * INLINE_BYTES, 1, _FLAGS)
            self.descriptors += descriptors
        except ConnectionError:
            packet = b""
        if not packet:
            raise Gone
        kind, rest = packet[:1], packet[1:]
        try:
            if kind == _INLINE:
                return pickle.loads(rest)
            stream, *large = self._get(*_LENGTH.unpack(rest))
            return pickle.loads(stream, buffers=large)
        except Exception as error:  # unpickling raises whatever it may
            raise Garbled(f"{type(error).__name__}: {error}") from error

    def _get(self, size: int) -> list[bytes]:
        if size > os.fstat(self._read.descriptor).st_size:  # who writes has made it grow
            raise ValueError("it is longer than the memory that it is in")
        self._read.hold(size)
        memory = self._read.bytes[:size]
        width = _LENGTH.size
        (count,) = _LENGTH.unpack(memory[:width])
        table = memory[width : (1 + count) * width]
        lengths = [length for (length,) in _LENGTH.iter_unpack(table)]
        ends = _ends((1 + count) * width, lengths)
        return [bytes(memory[end - n : end]) for n, end in zip(lengths, ends, strict=True)]

    @property
    def is_answered(self) -> bool:
        """Whether a message is there, or the other end is gone: `receive` does not wait."""
        return bool(self._poll.poll(0))

    def close(self) -> None:
        """Give it up; the other end finds that out."""
        self._socket.close()
        self._written.close()
        self._read.close()


def _mb(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _ends(begin: int, lengths: list[int]) -> list[int]:
    """Where parts of these lengths end that begin at multiples of a cache line."""
    ends = []
    for length in lengths:
        begin = -(-begin // _ALIGNED) * _ALIGNED + length
        ends.append(begin)
    return ends
