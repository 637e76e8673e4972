"""Ctrl-C, or SIGTERM, as a request: a run ends between two ticks and its report is written."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interruption:
    """While entered, the first signal sets `requested`; a second one interrupts as usual.

    `exit_code` is 128 and the number of the signal, as shells have it.
    """

    def __init__(self) -> None:
        self.requested = False
        self.exit_code = 128 + signal.SIGINT
        self._previous: dict[int, Any] = {}

    def request(self) -> None:
        """Ask the run to end."""
        self.requested = True

    def __enter__(self) -> Interruption:
        # Python lets only the main thread handle signals; elsewhere they are somebody else's.
        if threading.current_thread() is threading.main_thread():
            self._previous = {n: signal.signal(n, self._on_signal) for n in _SIGNALS}
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._restore()

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self.exit_code = 128 + number
        self.request()
        self._restore()

    def _restore(self) -> None:
        for number, handler in self._previous.items():
            # A handler that was not set from Python reads as None and cannot be set again.
            if handler is not None:
                signal.signal(number, handler)
        self._previous = {}
