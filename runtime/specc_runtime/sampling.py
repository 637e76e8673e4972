"""Sensors of the plant and what their readers see of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from specc_runtime.buffers import Put, freeze
from specc_runtime.system import System, whole_ticks
from specc_runtime.timeline import SensorRate


class Sensor:
    """The latest sample of a sensor, read-only, and how many there have been."""

    __slots__ = ("_sample", "count", "name", "value")

    def __init__(self, name: str, sample: Callable[[str], Any]) -> None:
        self.name = name
        self.count = 0
        self.value: Any = None
        self._sample = sample

    def update(self) -> None:
        """Take a sample."""
        value = self._sample(self.name)
        freeze(value)
        self.value = value
        self.count += 1


class Port:
    """A sensor as one of its readers sees it: a sample is fresh once."""

    __slots__ = ("_put", "_seen", "_sensor")

    def __init__(self, sensor: Sensor, put: Put) -> None:
        self._sensor = sensor
        self._put = put
        self._seen = 0

    def deliver(self) -> None:
        """Give the reader the latest sample, unless it has had it."""
        sensor = self._sensor
        if sensor.count != self._seen:
            self._seen = sensor.count
            self._put(sensor.value)


def sensor_rates(system: System) -> dict[str, SensorRate]:
    """The sensors that somebody reads, in the order in which the plant lists them.

    Raises ValueError for a rate that is no whole number of base ticks.
    """
    if system.plant is None:
        return {}
    rates = {}
    for binding in system.plant.sensors:
        readers = [i.subsystem for i in system.plant.inputs if i.sensor == binding.name]
        if readers:
            rate_hz = binding.rate_hz
            ticks = 0 if rate_hz is None else whole_ticks(1.0 / rate_hz, system.tick_s)
            rates[binding.name] = SensorRate(ticks, tuple(readers))
    return rates
