"""A window in which a person looks at the plant while it runs."""

import os
import sys
from typing import Any

from specc_runtime.plants.errors import PlantError


class Viewer:
    """An open window; shows the state of the last `sync`."""

    def __init__(self, model: Any, data: Any) -> None:
        """Open the window.

        Raises:
            PlantError: there is no display.
        """
        displays = ("DISPLAY", "WAYLAND_DISPLAY")
        if sys.platform == "linux" and not any(os.environ.get(name) for name in displays):
            # MuJoCo's window ends the process where it finds no display.
            raise PlantError(
                "there is no display for a viewer; `--video FILE.mp4` records the scene without one"
            )
        import mujoco.viewer

        self._window = mujoco.viewer.launch_passive(
            model, data, show_left_ui=False, show_right_ui=False
        )

    def sync(self) -> None:
        """Show the present state."""
        self._window.sync()

    @property
    def is_open(self) -> bool:
        """Whether the person has not closed the window."""
        return bool(self._window.is_running())

    def close(self) -> None:
        """Close the window."""
        self._window.close()
