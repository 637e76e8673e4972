"""What stands behind the elements of devices in the plant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from specc.model.system import Binding, Element, Plant, System

PlantKind = Literal["model", "python", ""]


@dataclass(frozen=True, slots=True)
class Bound:
    """A binding of an element that exists; `commanded` tells x of a device from y.

    `plant` is of what kind the plant is; empty if it is of none or of both.
    """

    binding: Binding
    element: Element
    commanded: bool
    plant: PlantKind


def plant_kind(plant: Plant | None) -> PlantKind:
    """Whether a MuJoCo model or Python stands behind the devices."""
    if plant is None or bool(plant.model) == bool(plant.python):
        return ""
    return "model" if plant.model else "python"


def bound_elements(system: System) -> Iterator[Bound]:
    """The bindings whose device and element exist."""
    devices = {device.qualified_name: device for device in system.devices}
    kind = plant_kind(system.plant)
    for binding in system.plant.bindings if system.plant else ():
        device = devices.get(binding.device)
        if device is None:
            continue
        for elements, commanded in ((device.x, True), (device.y, False)):
            for element in elements:
                if element.name == binding.element:
                    yield Bound(binding, element, commanded, kind)
