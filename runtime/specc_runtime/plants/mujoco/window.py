"""A window on the simulation, by MuJoCo's own passive viewer."""

from typing import Any

from specc_runtime.plants.errors import PlantError


class Window:
    """Shows the simulation as it is at each `show`; runs in a thread of its own."""

    def __init__(self, model: Any, data: Any) -> None:
        """Raises PlantError when no window can be opened."""
        try:
            import mujoco.viewer

            self._handle: Any = mujoco.viewer.launch_passive(
                model, data, show_left_ui=False, show_right_ui=False
            )
        except Exception as error:
            raise PlantError(f"cannot open a window: {error}") from error

    def is_open(self) -> bool:
        """Whether nobody has closed it."""
        return bool(self._handle.is_running())

    def show(self, left: str, right: str) -> None:
        """Show the present state with two columns of text in a corner."""
        self._handle.set_texts((None, None, left, right))
        self._handle.sync()

    def close(self) -> None:
        """Close it."""
        self._handle.close()
