"""Messages between agent and host: a kind and plain data, over a socket that only they have."""

from __future__ import annotations

import io
import pickle
import socket
import struct
import threading
from collections.abc import Iterator
from typing import Any

from specc_runtime.hosting.devices import Array, DeviceError

_HEAD = struct.Struct("<I")
_CHUNK = 1 << 18
_BACKLOG = 1 << 28
_PROTOCOL = 4
_ALIGNED = 64
"""Numbers of arrays begin at a multiple of a cache line."""
PLAIN, ARRAY = 0, 1
"""Kinds of values in shared memory."""


class NotPlain(Exception):
    """Bytes that are no plain data."""


def garbled(error: Exception) -> str:
    """What is said of a host whose messages cannot be understood."""
    return (
        f"the device host sent what is no message ({type(error).__name__}: {error}); "
        "a driver has written to a socket that is not its own"
    )


class _PlainUnpickler(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == (Array.__module__, Array.__name__):
            return Array
        raise NotPlain(f"{module}.{name} is no plain data")


def plain(data: bytes | memoryview) -> Any:
    """The plain data that `packed` made bytes of; raises `NotPlain`."""
    try:
        return _PlainUnpickler(io.BytesIO(data)).load()
    except NotPlain:
        raise
    except Exception as error:
        raise NotPlain(f"{type(error).__name__}: {error}") from error


def packed(value: Any) -> bytes:
    """Bytes of a value; raises `DeviceError`."""
    try:
        return pickle.dumps(value, _PROTOCOL)
    except Exception as error:
        raise DeviceError(f"a value that is no plain data: {type(error).__name__}") from error


def parts_of(value: Any) -> tuple[int, tuple[bytes | memoryview, ...]]:
    """The kind and the bytes of a value for shared memory; raises `DeviceError`."""
    if type(value) is not Array:
        return PLAIN, (packed(value),)
    head = packed((str(value.dtype), tuple(value.shape)))
    try:
        data = memoryview(value.data).cast("B")
    except (TypeError, ValueError) as error:
        raise DeviceError(f"the data of an array are no bytes: {error}") from error
    head += bytes(-(_HEAD.size + len(head)) % _ALIGNED)  # pickles end with a mark of their own
    return ARRAY, (_HEAD.pack(len(head)), head, data)


def array_of(data: bytes | memoryview) -> Array:
    """The array that `parts_of` made bytes of; raises `NotPlain`."""
    (length,) = _HEAD.unpack_from(data)
    begin = _HEAD.size + length
    dtype, shape = plain(data[_HEAD.size : begin])
    return Array(dtype, shape, memoryview(data)[begin:])


class HostChannel:
    """One end of the socket. `is_over` is true once the other end is gone.

    Nothing here waits. What the other end does not take is kept, up to a bound.
    """

    def __init__(self, end: socket.socket) -> None:
        end.setblocking(False)
        self.is_over = False
        self._end = end
        self._is_deaf = False
        self._lock = threading.Lock()
        self._outgoing = bytearray()
        self._incoming = bytearray()

    def fileno(self) -> int:
        """For a selector."""
        return self._end.fileno()

    def send(self, kind: str, *data: Any) -> bool:
        """Send a message; whether there is room for it. If the other end is gone, it is lost."""
        body = packed((kind, *data))
        with self._lock:
            if len(self._outgoing) + len(body) > _BACKLOG:
                return False
            self._outgoing += _HEAD.pack(len(body)) + body
            self._flush()
        return True

    def flush(self) -> bool:
        """Send what was kept, as far as there is room; whether all is sent."""
        with self._lock:
            self._flush()
            return self._is_deaf or not self._outgoing

    def _flush(self) -> None:
        try:
            while self._outgoing and not self._is_deaf:
                del self._outgoing[: self._end.send(self._outgoing)]
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:  # what it said before it went is still to be read
            self._is_deaf = True

    def received(self) -> Iterator[tuple[Any, ...]]:
        """The messages that have come, each once; raises `NotPlain`."""
        self._read()
        while body := self._next():
            message = plain(body)
            if not isinstance(message, tuple) or not message:
                raise NotPlain(f"a value of the type {type(message).__name__}")
            yield message

    def _read(self) -> None:
        try:
            while not self.is_over:
                chunk = self._end.recv(_CHUNK)
                self._incoming += chunk
                self.is_over = not chunk
        except (BlockingIOError, InterruptedError):
            pass
        except OSError:
            self.is_over = True

    def _next(self) -> bytes:
        """The next message, once all of it has come; until then nothing."""
        if len(self._incoming) < _HEAD.size:
            return b""
        end = _HEAD.size + _HEAD.unpack_from(self._incoming)[0]
        if end > _HEAD.size + _BACKLOG:
            raise NotPlain("no message is as long")
        if end > len(self._incoming):
            return b""
        body = bytes(self._incoming[_HEAD.size : end])
        del self._incoming[:end]
        return body

    def close(self) -> None:
        """Close this end; the other one notices."""
        self.is_over = True
        self._end.close()
