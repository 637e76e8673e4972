"""The only reader of wall time. Everything that a run computes depends on simulated time alone."""

from __future__ import annotations

import time
from collections.abc import Callable

_LOOK_S = 0.05
"""How soon a clock that is waited for notices that the run is over."""


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


class EndingClock(WallClock):
    """A clock that is not waited for any longer once the run is over."""

    __slots__ = ("_clock", "_is_over")

    def __init__(self, clock: WallClock, is_over: Callable[[], bool]) -> None:
        self._clock, self._is_over = clock, is_over

    def now_s(self) -> float:
        """See `WallClock`."""
        return self._clock.now_s()

    def wait(self, duration_s: float) -> None:
        """See `WallClock`. Signals do not end a long sleep, so there are several."""
        if duration_s > _LOOK_S:
            until_s = self.now_s() + duration_s
            while (duration_s := until_s - self.now_s()) > _LOOK_S and not self._is_over():
                self._clock.wait(_LOOK_S)
        if not self._is_over():
            self._clock.wait(duration_s)
