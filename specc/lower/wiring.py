"""Connections between subsystems: which output element becomes which input element."""

from __future__ import annotations

from collections.abc import Iterator

from specc.lower.module import buffer_names
from specc.lower.text import literal
from specc.model.system import Port, Subsystem, System


def connections(system: System) -> Iterator[str]:
    """Calls of `Connection`, by reader, in order of its buffers."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    for reader in system.subsystems:
        inputs = buffer_names(reader, "x")
        for port in reader.ports:
            sender = subsystems.get(port.other_end)
            back = _port_to(sender, reader.qualified_name) if sender else None
            if port.direction != "x" or sender is None or back is None:
                continue
            outputs = buffer_names(sender, "y")
            for element in port.elements:
                if back.element(element.name):
                    ends = (
                        sender.qualified_name,
                        outputs[back.peer, element.name],
                        reader.qualified_name,
                        inputs[port.peer, element.name],
                    )
                    yield f"Connection({', '.join(map(literal, ends))})"


def _port_to(sender: Subsystem, reader: str) -> Port | None:
    ports = (p for p in sender.ports if p.direction == "y" and p.other_end == reader)
    return next(ports, None)
