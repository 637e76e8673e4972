"""A real effector belongs to one virtual effector; nothing is commanded from two sides (2.1)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.model.system import Device, Subsystem, System
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0406."""
    for device in system.devices:
        users = _users(device, system)
        for name, place in users[1:]:
            yield Diagnostic(
                "E0406",
                f"`{device.qualified_name}` belongs to `{users[0][0]}` already",
                place,
                f"`{name}` uses it too",
                (Related(users[0][1], "used here first"), Related(device.place, "the device")),
                "let one subsystem work with it and pass the data on",
            )


def _users(device: Device, system: System) -> list[tuple[str, Place]]:
    """Who may not share the device: users of an effector, those that command a receptor."""
    found: dict[str, Place] = {}
    for subsystem in system.subsystems:
        for port in subsystem.ports:
            if port.other_end == device.qualified_name and _owns(device, subsystem, port.direction):
                found.setdefault(subsystem.qualified_name, port.place)
    return list(found.items())


def _owns(device: Device, subsystem: Subsystem, direction: str) -> bool:
    return device.kind == "real_effector" or direction == "y"
