"""If there is a plant, something stands behind every element of every device."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0502."""
    if system.plant is None:
        return
    bound = {(b.device, b.element) for b in system.plant.bindings}
    for device in system.devices:
        for element in (*device.x, *device.y):
            if (device.qualified_name, element.name) not in bound:
                yield Diagnostic(
                    "O0502",
                    f"nothing in the plant stands behind `{device.qualified_name}.{element.name}`",
                    element.place,
                    related=(Related(system.plant.place, "the plant"),),
                    help=f"add `{device.qualified_name}.{element.name}: {{...}}` under `bind:`",
                )
