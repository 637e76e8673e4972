"""Range finders: what they give where their beam meets nothing."""

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.library import mujoco

_RANGEFINDER = mujoco.mjtSensor.mjSENS_RANGEFINDER.value
_FIELDS = mujoco.mjtRayDataField
# What a range finder gives is a set of fields; these two are distances.
_DISTANCES = (1 << _FIELDS.mjRAYDATA_DIST.value, 1 << _FIELDS.mjRAYDATA_DEPTH.value)


def reach_m(model: Any, sensor: int) -> float:
    """How far a range finder sees: its `cutoff`, infinitely far without one; 0 of other sensors.

    One that gives more than distances counts as another sensor: its numbers are for `through`.
    """
    if model.sensor_type[sensor] != _RANGEFINDER:
        return 0.0
    if model.sensor_intprm[sensor][0] not in _DISTANCES:
        return 0.0
    return float(model.sensor_cutoff[sensor]) or inf


class Ranges:
    """The distances among the raw numbers of one element, from range finders.

    MuJoCo gives -1 where a beam meets nothing, and the `cutoff` where what it meets is farther.
    """

    def __init__(self, binding: SensorBinding, reach: Array, names: Sequence[str]) -> None:
        """Of raw numbers with that reach (n,), 0 where a number is not from a range finder.

        `names` are those of the sensors that give each of them.
        """
        self._binding = binding
        self._names = names
        self._where = np.flatnonzero(reach)
        self._reach = reach[self._where]

    def __bool__(self) -> bool:
        return bool(self._where.size)

    def read(self, raw: Array, noisy: Array) -> Array:
        """(n,) the noisy numbers, with the reach of each range finder that meets nothing within it.

        The reach has no noise, and noise leads no distance beyond it. It is infinite without a
        `cutoff`, which only a function of `through` can take.

        Raises:
            PlantError: a distance is infinite, and there is no such function.
        """
        exact = raw[self._where]
        nothing = (exact < 0.0) | (exact >= self._reach)
        distances = np.where(nothing, self._reach, np.minimum(noisy[self._where], self._reach))
        if self._binding.through is None and np.isinf(distances).any():
            name = self._names[self._where[np.isinf(distances)][0]]
            raise PlantError(
                f"the beam of the range finder {name!r} meets nothing, so there is no distance; a "
                "`cutoff` of the sensor in the model is what it gives then"
            )
        numbers = noisy.copy()
        numbers[self._where] = distances
        return numbers
