"""How far many runs are: a line on a terminal that changes, or lines of a log."""

from __future__ import annotations

import sys
import time

from specc.cli import streams
from specc.diagnostics.phrases import counted

_LOGGED_S = 10.0
"""Wall time between two lines of a log."""


class RunProgress:
    """How many runs are done and how long the rest may take: a line that changes, or a log."""

    def __init__(self, count: int, before: int) -> None:
        self._count, self._before = count, before
        self._begun_s = self._shown_s = time.monotonic()
        self._live = sys.stderr.isatty()

    def update(self, done: int) -> None:
        """So many runs are done now, besides those from before."""
        now_s = time.monotonic()
        if now_s - self._shown_s < (0.2 if self._live else _LOGGED_S):
            return
        self._shown_s = now_s
        words = f"{self._before + done} of {counted(self._count, 'run')}"
        if done:
            left = self._count - self._before - done
            words += f", {_duration((now_s - self._begun_s) / done * left)} left"
        if self._live:
            streams.update_status_line(words)
        else:
            streams.print_message(words)

    def close(self) -> None:
        """The last line is no longer true."""
        if self._live:
            streams.update_status_line("")


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
