"""What stands behind the elements of devices in the plant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from specc.model.system import Binding, Element, System


@dataclass(frozen=True, slots=True)
class Bound:
    """A binding of an element that exists; `commanded` tells x of a device from y."""

    binding: Binding
    element: Element
    commanded: bool


def bound_elements(system: System) -> Iterator[Bound]:
    """The bindings whose device and element exist."""
    devices = {device.qualified_name: device for device in system.devices}
    for binding in system.plant.bindings if system.plant else ():
        device = devices.get(binding.device)
        if device is None:
            continue
        for elements, commanded in ((device.x, True), (device.y, False)):
            for element in elements:
                if element.name == binding.element:
                    yield Bound(binding, element, commanded)
