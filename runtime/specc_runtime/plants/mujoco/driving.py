"""Actuators: from a held command to the controls of the model."""

from typing import Any

import numpy as np

from specc_runtime.plants.binding import ActuatorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.model import find, position_indices, velocity_indices


class Actuator:
    """One bound actuator with the command it holds; without a command it exerts nothing."""

    def __init__(self, model: Any, data: Any, binding: ActuatorBinding) -> None:
        if not binding.actuators:
            raise PlantError(f"actuator '{binding.name}' drives nothing")
        self._binding = binding
        self._data = data
        self._controls = np.array([find(model, "actuator", a) for a in binding.actuators])
        self._positions = position_indices(model, binding.joints)
        self._velocities = velocity_indices(model, binding.joints)
        self.reset()

    def reset(self) -> None:
        """Forget the command."""
        self.command: Any = None

    def drive(self) -> None:
        """Set the controls from the held command and the present joint state.

        Raises:
            PlantError: the controls are not finite or not as many as the actuators.
        """
        if self.command is None:
            return
        control = self.command
        if self._binding.through is not None:
            control = self._binding.through(control, self._raw())
        values = np.atleast_1d(np.asarray(control, dtype=float))
        if values.shape != self._controls.shape or not np.isfinite(values).all():
            raise PlantError(
                f"actuator '{self._binding.name}' needs {self._controls.size} finite numbers, "
                f"got {values}"
            )
        self._data.ctrl[self._controls] = values

    def _raw(self) -> Any:
        data = self._data
        return np.concatenate((data.qpos[self._positions], data.qvel[self._velocities]))
