"""The line to the server of a page: a thread writes what there is to see and reads commands.

The server may be slow, stopped or dead: whoever posts a message never waits for it.
"""

from __future__ import annotations

import json
import os
import selectors
import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from specc_runtime.forms import Misshapen
from specc_runtime.interruption import SIGNALS
from specc_runtime.recording.text import loaded

Content = bytes | Callable[[], bytes]
"""A message, or what makes it in the thread of the link."""
_MOST_WEIGHT = 20_000
"""Of the messages that wait."""
_LONGEST = 1 << 20
"""Bytes of a command."""
_PIECE = 1 << 16


class Link:
    """Messages in JSON, one a line, both ways over a socket that another process has inherited.

    Of what is shown only the newest one waits. Of other messages a bounded number waits, and what
    finds no room is lost, which the server is told.
    """

    def __init__(
        self, descriptor: int, obey: Callable[[Any], None], on_end: Callable[[], None]
    ) -> None:
        """`obey` is called in the thread with each command, `on_end` once the server has gone."""
        self.is_over = False
        """Whether nobody reads any more."""
        self.failure = ""
        """Why a message could not be made, the first time."""
        self._socket = socket.socket(fileno=descriptor)
        self._socket.setblocking(False)
        self._obey, self._on_end = obey, on_end
        self._lock = threading.Lock()
        self._queue: deque[tuple[int, Content]] = deque()
        self._weight = 0
        self._lost = 0
        self._newest: Content | None = None
        self._until_s: float | None = None
        self._begun = bytearray()
        self._skips = False
        self._bell, self._ring = os.pipe()
        os.set_blocking(self._ring, False)
        os.set_blocking(self._bell, False)
        self._thread = threading.Thread(target=self._work, name="specc-page", daemon=True)
        self._thread.start()

    def show(self, content: Content) -> None:
        """Send this as soon as possible, unless something newer is shown by then."""
        self._newest = content
        self._wake()

    def post(self, content: Content, weight: int = 1) -> None:
        """Send this after all that was posted before; without a `weight`, whatever waits."""
        with self._lock:
            if self.is_over:
                return
            if weight and self._weight + weight > _MOST_WEIGHT:
                self._lost += 1
                return
            if self._lost:
                self._queue.append((0, b'{"kind":"lost","messages":%d}' % self._lost))
                self._lost = 0
            self._queue.append((weight, content))
            self._weight += weight
        self._wake()

    def close(self, wait_s: float = 1.0) -> None:
        """Send what waits, but not for long, and hang up."""
        self._until_s = time.monotonic() + wait_s
        self._wake()
        self._thread.join(2 * wait_s)

    def _wake(self) -> None:
        with suppress(OSError):  # it is full: the thread wakes anyway
            os.write(self._ring, b"x")

    def _work(self) -> None:
        # A signal that this thread gets does not wake the main one, which alone handles it.
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        try:
            self._exchange()
        except OSError:  # the server has gone
            pass
        finally:
            with self._lock:
                self.is_over = True
                self._queue.clear()
            self._newest = None
            self._socket.close()
            self._on_end()

    def _exchange(self) -> None:
        rest = memoryview(b"")
        with selectors.DefaultSelector() as selector:
            selector.register(self._bell, selectors.EVENT_READ)
            selector.register(self._socket, selectors.EVENT_READ)
            while True:
                rest = rest or memoryview(self._next())
                left_s = None if self._until_s is None else self._until_s - time.monotonic()
                if left_s is not None and (left_s <= 0 or not rest):
                    return
                both = selectors.EVENT_READ | (selectors.EVENT_WRITE if rest else 0)
                selector.modify(self._socket, both)
                for key, events in selector.select(left_s):
                    if key.fd == self._bell:
                        os.read(self._bell, _PIECE)
                        continue
                    if events & selectors.EVENT_READ and not self._read():
                        return
                    if events & selectors.EVENT_WRITE:
                        rest = rest[self._socket.send(rest) :]

    def _next(self) -> bytes:
        """The next message with its end of line; empty if there is none."""
        while True:
            with self._lock:
                if self._queue:
                    weight, content = self._queue.popleft()
                    self._weight -= weight
                elif self._newest is not None:
                    content, self._newest = self._newest, None
                else:
                    return b""
            try:
                return (content if isinstance(content, bytes) else content()) + b"\n"
            except Exception as error:  # noqa: BLE001  # a value of the user's that has no text
                if not self.failure:
                    self.failure = f"{type(error).__name__}: {error}"
                    text = f"something of the run cannot be shown: {self.failure}"
                    self.post(json.dumps({"kind": "refused", "text": text}).encode())

    def _read(self) -> bool:
        """Obey what has come; whether more may come."""
        try:
            piece = self._socket.recv(_PIECE)
        except BlockingIOError:
            return True
        self._begun += piece
        *lines, rest = self._begun.split(b"\n")
        self._begun = rest
        for line in lines:
            if not self._skips:
                self._obey(_command(bytes(line)))
            self._skips = False
        if len(rest) > _LONGEST:
            self._begun, self._skips = bytearray(), True
            self._obey(None)
        return bool(piece)


def _command(line: bytes) -> Any:
    """The data of a line; None if it is none."""
    try:
        return loaded(line)  # which takes no text that could not be sent back
    except Misshapen:
        return None
