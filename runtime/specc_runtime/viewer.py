"""A window on the running plant, not faster than real time."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from specc_runtime.clock import WallClock
from specc_runtime.companion import View


class Viewer:
    """Shows the plant; closing the window ends the run."""

    period_s = 0.02

    def __init__(self, plant: Any, clock: WallClock, stop: Callable[[], None]) -> None:
        """The plant needs `open_viewer()`; what that raises without a display goes through."""
        self._window = plant.open_viewer()
        self._clock = clock
        self._stop = stop
        self._origin_s = clock.now_s()

    def tick(self, view: View) -> None:
        """See `Companion`."""
        if not self._window.is_open:
            self._stop()
            return
        self._window.sync()
        late_s = self._clock.now_s() - self._origin_s - view.time_s
        if late_s > 0.0:
            self._origin_s += late_s  # time that was lost is not caught up
        self._clock.wait(-late_s)

    def close(self) -> None:
        """See `Companion`."""
        self._window.close()
