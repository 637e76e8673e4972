"""The only reader of wall time. Everything that a run computes depends on simulated time alone."""

from __future__ import annotations

import time


class WallClock:
    """Seconds since an arbitrary moment. Tests pass a clock of their own."""

    __slots__ = ()

    def now_s(self) -> float:
        """Monotonic wall time, seconds."""
        return time.perf_counter()

    def wait(self, duration_s: float) -> None:
        """Let wall time pass; not at all if the duration is negative."""
        if duration_s > 0.0:
            time.sleep(duration_s)

    def date_ns(self) -> int:
        """Nanoseconds since 1970, for people who look at a recording."""
        return time.time_ns()
