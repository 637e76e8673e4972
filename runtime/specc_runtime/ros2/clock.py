"""The time of `/clock` as the clock of a run."""

from __future__ import annotations

import time
from collections.abc import Callable

from specc_runtime.clock import WallClock
from specc_runtime.plants.errors import PlantError

_LOOK_S = 5e-4
"""How often is looked for a new time while it is waited for."""


class RosClock(WallClock):
    """Simulated time: it stands still while the simulation pauses. Never raises.

    `newest` gives the time of the last message, s; `goes_on` says that the agent lives, and tells
    whether to wait any longer. A time that is before an earlier one is told to `failed`, once.
    """

    __slots__ = ("_failed", "_goes_on", "_is_over", "_last_s", "_newest", "awaited_s")

    def __init__(
        self,
        newest: Callable[[], float],
        goes_on: Callable[[], bool],
        failed: Callable[[PlantError], None],
    ) -> None:
        self._newest, self._goes_on, self._failed = newest, goes_on, failed
        self._last_s = newest()
        self._is_over = False
        self.awaited_s: float | None = None
        """The time that is waited for, if any."""

    def now_s(self) -> float:
        """Simulated time, s."""
        now_s = self._newest()
        if now_s < self._last_s and not self._is_over:
            self._is_over = True
            self._failed(
                PlantError(
                    f"/clock jumped back from {self._last_s:.6g} s to {now_s:.6g} s: the "
                    "simulation was reset"
                )
            )
        self._last_s = max(self._last_s, now_s)
        return self._last_s

    def wait(self, duration_s: float) -> None:
        """Let simulated time pass, however long that takes."""
        until_s = self.now_s() + duration_s
        self.awaited_s = until_s
        while not self._is_over and self.now_s() < until_s and self._goes_on():
            time.sleep(_LOOK_S)
        self.awaited_s = None
