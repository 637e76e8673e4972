"""Every real effector and receptor is used by a subsystem."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.model.system import Device, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0404; not of an agent with a broken subsystem, or one that claims another's device."""
    used = {port.other_end for s in system.subsystems for port in s.ports}
    unsure = {name.split(".")[0] for name in facts.broken | facts.connections.contested}
    for device in system.devices:
        if device.qualified_name not in used and device.agent not in unsure:
            kind = "effector" if device.kind == "real_effector" else "receptor"
            yield Diagnostic(
                "O0404",
                f"no subsystem uses the real {kind} `{device.name}`",
                device.place,
                help=_way_out(device, kind, system),
            )


def _way_out(device: Device, kind: str, system: System) -> str:
    """Its own virtual effector or receptor, if there is one, lacks the buffers."""
    names = {subsystem.qualified_name for subsystem in system.subsystems}
    if f"{device.agent}.{device.name}" in names:
        letter = kind[0].upper()
        return f"add `{letter}: {{...}}` under the `x:` and `y:` of `{device.name}`"
    return f"add a virtual {kind} `{device.name}`, or delete the device"
