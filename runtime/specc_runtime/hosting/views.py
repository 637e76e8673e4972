"""The values of samples from their bytes, and how another process than the agent's reads them."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from specc_runtime.blocks import Block
from specc_runtime.faults import DeviceFailed, error_text
from specc_runtime.hosting.devices import Array
from specc_runtime.hosting.memory import Extent
from specc_runtime.hosting.wire import PLAIN, array_of, plain
from specc_runtime.plant import NO_SAMPLE, Deferred
from specc_runtime.plants.errors import PlantError
from specc_runtime.sampling import Sensor
from specc_runtime.system import PlantSpec

Convert = Callable[[Any], Any]


def value_of(kind: int, data: bytes | memoryview, decode: Convert | None) -> Any:
    """The value of a sample; arrays of numbers are views of `data`.

    Raises PlantError, and DeviceFailed for a function that is not of the plant.
    """
    try:
        value = plain(data) if kind == PLAIN else _as_array(array_of(data))
        return value if decode is None else decode(value)
    except (PlantError, DeviceFailed):
        raise
    except Exception as error:
        raise PlantError(f"a value that cannot be read: {error_text(error)}") from error


def _as_array(array: Array) -> Any:
    """The array, read-only; raises TypeError, ValueError for one that does not fit its bytes."""
    return np.frombuffer(array.data, np.dtype(array.dtype)).reshape(array.shape)


class Views:
    """Samples in the memory of the device host, for the process of a subsystem that reads them."""

    def __init__(
        self, spec: PlantSpec, subsystem: str, decode: Mapping[str, Convert], descriptor: int
    ) -> None:
        """`descriptor` is of the memory; for `decode` see `HostedPlant`."""
        bindings = {binding.name: binding for binding in spec.sensors}
        self._sensors = {
            item.element: Sensor(bindings[item.sensor], lambda _: NO_SAMPLE)
            for item in spec.inputs
            if item.subsystem == subsystem
        }
        self._decode = decode
        self._block = Block(descriptor, is_read_only=True)
        self._seen: dict[Extent, weakref.ref[Any]] = {}

    def value(self, element: str, extent: Extent) -> Any:
        """The value of a sample, which does not change; raises DeviceFailed."""
        sensor = self._sensors[element]
        decode = self._decode.get(sensor.name)
        return sensor.computed(Deferred(lambda: value_of(extent.kind, self._bytes(extent), decode)))

    def _bytes(self, extent: Extent) -> memoryview:
        """The bytes there, which are in use until nothing that was made of them is left."""
        found: Any = self._seen[extent]() if extent in self._seen else None
        if found is None:
            self._block.hold(extent.begin + extent.length)
            found = np.frombuffer(self._block.bytes, np.uint8, extent.length, extent.begin)
            self._seen[extent] = weakref.ref(found)
        return memoryview(found)

    def extents_in_use(self) -> tuple[Extent, ...]:
        """The extents that are in use."""
        self._seen = {extent: seen for extent, seen in self._seen.items() if seen() is not None}
        return tuple(self._seen)
