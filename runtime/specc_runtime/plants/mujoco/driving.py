"""Actuators: from a held command to the controls of the model."""

from math import isfinite
from typing import Any

import numpy as np

from specc_runtime.faults import DeviceFailed, text_of
from specc_runtime.plants.binding import ActuatorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.limits import ClipCount
from specc_runtime.plants.mujoco.model import find, position_indices, velocity_indices


class Actuator:
    """One bound actuator with the command it holds; without a command it exerts nothing."""

    def __init__(self, model: Any, data: Any, binding: ActuatorBinding) -> None:
        if not binding.actuators:
            raise PlantError(f"actuator '{binding.name}' drives nothing")
        self._binding = binding
        self._data = data
        self._ctrl, self._qpos, self._qvel = data.ctrl, data.qpos, data.qvel
        self._controls = np.array([find(model, "actuator", a) for a in binding.actuators])
        self._positions = position_indices(model, binding.joints)
        self._velocities = velocity_indices(model, binding.joints)
        self.clips = ClipCount(model, self._controls.tolist())
        self.reset()

    def reset(self) -> None:
        """Forget the command, and how often controls were cut."""
        self.command: Any = None
        self.clips.found = None

    def drive(self) -> None:
        """Set the controls from the held command and the present joint state.

        Raises:
            PlantError: the command is not as many finite numbers as there are actuators.
            DeviceFailed: `through` failed, or gave what the actuators cannot take.
        """
        if self.command is None:
            return
        through, name = self._binding.through, self._binding.name
        if through is None:
            self._ctrl[self._controls] = self._controls_of(self.command)
            return
        raw = self._raw()
        try:
            self._ctrl[self._controls] = self._controls_of(through(self.command, raw))
        except BaseException as error:  # whatever the user's function raises
            inputs = {"command": self.command, "raw": raw}
            raise DeviceFailed(name, error, inputs, through) from error

    def moves(self, actuators: frozenset[int]) -> bool:
        """Whether it drives any of the actuators with these indices."""
        return not actuators.isdisjoint(self._controls.tolist())

    def _controls_of(self, numbers: Any) -> Any:
        """(n,) one finite number for each actuator; raises PlantError."""
        try:
            values = np.asarray(numbers)
            values = values.reshape(1) if values.ndim == 0 else values
            fits = values.shape == self._controls.shape and values.dtype.kind in "fiu"
        except (TypeError, ValueError):
            fits = False
        controls = values.tolist() if fits else []
        if not fits or not all(map(isfinite, controls)):
            raise PlantError(
                f"actuator '{self._binding.name}' needs {self._controls.size} finite numbers, "
                f"got {text_of(numbers)}",
                device=self._binding.name,
            )
        self.clips.watch(controls, self._data.time)
        return values

    def _raw(self) -> Any:
        return np.concatenate((self._qpos[self._positions], self._qvel[self._velocities]))
