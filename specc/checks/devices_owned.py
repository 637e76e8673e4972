"""A real effector belongs to one virtual effector; nothing is commanded from two sides (2.1)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.model.system import Device, Port, Subsystem, System
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0406, at what makes a subsystem the second owner."""
    for device in system.devices:
        owners = facts.connections.owners(device)
        for subsystem, port in owners[1:]:
            first, its_port = owners[0]
            yield Diagnostic(
                "E0406",
                f"`{device.qualified_name}` belongs to `{first.qualified_name}` already",
                _claim(device, subsystem, port),
                f"`{subsystem.qualified_name}` uses it too",
                (Related(its_port.place, "used here"), Related(device.place, "the device")),
                "let one subsystem work with it and pass the data on",
            )


def _claim(device: Device, subsystem: Subsystem, port: Port) -> Place:
    """Where a subsystem says that it works with a device."""
    if subsystem.kind == "control" or subsystem.name == device.name:
        return port.place
    return below(subsystem.place, "uses")
