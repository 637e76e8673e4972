"""A window on the running plant, not faster than real time."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any

from specc_runtime.clock import WallClock
from specc_runtime.companion import View
from specc_runtime.options import UsageError

WINDOWED = ("darwin", "win32")
"""Platforms that always have a display."""


class Viewer:
    """Shows the plant; closing the window ends the run."""

    period_s = 0.02

    def __init__(self, plant: Any, clock: WallClock, stop: Callable[[], None]) -> None:
        """Raises UsageError where there is no display; the plant needs `window()`."""
        if sys.platform not in WINDOWED and not has_display():
            raise UsageError(
                "--viewer needs a display and there is none (neither DISPLAY nor WAYLAND_DISPLAY "
                "is set); --video FILE.mp4 records the scene without one"
            )
        self._window = plant.window()
        self._clock = clock
        self._stop = stop
        self._ahead_s = -clock.now_s()

    def tick(self, view: View) -> None:
        """See `Companion`."""
        if not self._window.is_open():
            self._stop()
            return
        self._window.show("\n".join(view.states), "\n".join(view.states.values()))
        late_s = self._ahead_s + self._clock.now_s() - view.time_s
        if late_s > 0.0:
            self._ahead_s -= late_s  # time that was lost is not caught up
        self._clock.wait(-late_s)

    def close(self) -> None:
        """See `Companion`."""
        self._window.close()


def has_display() -> bool:
    """Whether there is an X or Wayland display to open a window on."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
