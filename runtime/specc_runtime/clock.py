"""The only reader of wall time. Everything that a run computes depends on simulated time alone."""

from __future__ import annotations

import time


class WallClock:
    """Seconds since an arbitrary moment. Tests pass a clock of their own."""

    __slots__ = ()

    def now_s(self) -> float:
        """Monotonic wall time, seconds."""
        return time.perf_counter()
