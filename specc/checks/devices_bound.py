"""If there is a plant, something stands behind every element of every device."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related, nearest
from specc.facts import Facts
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0502; not for an element that an unknown one is nearest to, which `bindings_known` tells."""
    if system.plant is None:
        return
    bound = {(b.device, b.element) for b in system.plant.bindings}
    elements = {
        (d.qualified_name, e.name): f"{d.qualified_name}.{e.name}"
        for d in system.devices
        for e in (*d.x, *d.y)
    }
    open_ = {name for key, name in elements.items() if key not in bound}
    strange = [f"{device}.{element}" for device, element in bound - elements.keys()]
    meant = {name for other in strange for name in nearest(other, open_)[:1]}
    for device in system.devices:
        for element in (*device.x, *device.y):
            if elements[device.qualified_name, element.name] in open_ - meant:
                yield Diagnostic(
                    "O0502",
                    f"nothing in the plant stands behind `{device.qualified_name}.{element.name}`",
                    element.place,
                    related=(Related(system.plant.place, "the plant"),),
                    help=f"add `{device.qualified_name}.{element.name}: {{...}}` under `bind:`",
                )
