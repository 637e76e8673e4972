"""The wires of a system: what is at the other end of each buffer, and who sends each element.

Every question about the other end of a buffer is asked here; nothing else matches names of peers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from specc.model.fsm import Behaviour
from specc.model.system import Agent, Device, Element, Port, Subsystem
from specc.reachable import grouped
from specc.source import Place

Direction = Literal["x", "y"]
Output = tuple[str, tuple[str, str]]
"""The qualified name of a subsystem, and peer and element of a buffer there."""


@dataclass(frozen=True, slots=True)
class Wire:
    """A port of `subsystem`, and the part of the system at its other end.

    That part, `peer`, is None where the system has none. If it is a subsystem, `peer_port` is its
    port, None where that is missing.
    """

    subsystem: Subsystem
    port: Port
    peer: Subsystem | Device | None
    peer_port: Port | None

    @property
    def peer_name(self) -> str:
        """The qualified name of the part at the other end, which may be missing."""
        return self.port.other_end

    @property
    def peer_device(self) -> Device | None:
        """The device at the other end, if it is one."""
        return self.peer if isinstance(self.peer, Device) else None

    @property
    def peer_subsystem(self) -> Subsystem | None:
        """The subsystem at the other end, if it is one."""
        return self.peer if isinstance(self.peer, Subsystem) else None

    @property
    def elements(self) -> tuple[Element, ...]:
        """The elements that the other end declares: a device reports in `y` what is read in `x`."""
        if self.peer_device:
            return self.peer_device.y if self.port.direction == "x" else self.peer_device.x
        return self.peer_port.elements if self.peer_port else ()

    def inputs_sent_by(self, behaviour: Behaviour) -> frozenset[tuple[str, str]]:
        """The inputs of `subsystem`, (peer, element), that a behaviour of its peer sends."""
        peers = {self.peer_port.peer} if self.peer_port else set()
        return frozenset((self.port.peer, a.name) for a in behaviour.assignments if a.peer in peers)


class Wires:
    """The wires of some agents, with all that these have in them."""

    def __init__(self, agents: Sequence[Agent]) -> None:
        self._agents = agents

    @cached_property
    def subsystems(self) -> dict[str, Subsystem]:
        """All subsystems by qualified name."""
        return {s.qualified_name: s for agent in self._agents for s in agent.subsystems}

    @cached_property
    def devices(self) -> dict[str, Device]:
        """All devices by qualified name."""
        return {d.qualified_name: d for agent in self._agents for d in agent.devices}

    def part(self, name: str) -> Subsystem | Device | None:
        """The subsystem or device of a qualified name; None if there is none."""
        return self.devices.get(name) or self.subsystems.get(name)

    def peer_place(self, subsystem: Subsystem, port: Port) -> Place | None:
        """The place of the definition that names the peer: an agent, not its control subsystem."""
        other = self.part(port.other_end)
        if other is None or other.agent == subsystem.agent:
            return other.place if other else None
        return next((a.place for a in self._agents if a.name == other.agent), None)

    @cached_property
    def _wires(self) -> list[Wire]:
        return [w for agent in self._agents for s in agent.subsystems for w in self.wires_of(s)]

    @cached_property
    def _ports(self) -> dict[tuple[str, str, str], Port]:
        """Direction, owner and other end -> port; of several between two subsystems the first."""
        owned = [(s, p) for agent in self._agents for s in agent.subsystems for p in s.ports]
        return {(p.direction, s.qualified_name, p.other_end): p for s, p in reversed(owned)}

    @cached_property
    def _by_peer(self) -> dict[str, list[Wire]]:
        return grouped((wire.peer_name, wire) for wire in self._wires)

    @cached_property
    def _inputs(self) -> dict[tuple[str, str], Wire]:
        found = (wire for wire in reversed(self._wires) if wire.port.direction == "x")
        return {(wire.subsystem.qualified_name, wire.port.peer): wire for wire in found}

    def wires_of(self, subsystem: Subsystem) -> list[Wire]:
        """The wires of all ports of a subsystem, in their order."""
        name = subsystem.qualified_name
        return [
            Wire(subsystem, p, self.part(p.other_end), self._ports.get((far, p.other_end, name)))
            for p in subsystem.ports
            for far in ("y" if p.direction == "x" else "x",)
        ]

    def wires_to(self, name: str, direction: Direction | None = None) -> list[Wire]:
        """The wires that lead to a subsystem or device, from ports of a direction alone."""
        found = self._by_peer.get(name, ())
        return [wire for wire in found if direction in (None, wire.port.direction)]

    def input_wire(self, reader: str, peer: str) -> Wire | None:
        """The wire of an input buffer; None without one."""
        return self._inputs.get((reader, peer))

    def sender(self, reader: str, key: tuple[str, str]) -> Output | None:
        """The output that a subsystem sends to an input; None for what a device reports.

        With the peer "" the reader is a device.
        """
        peer, element = key
        if not peer:
            for wire in self.wires_of_element(reader, "y", element):
                return wire.subsystem.qualified_name, (wire.port.peer, element)
        found = self.input_wire(reader, peer)
        return (
            (found.peer_name, (found.peer_port.peer, element))
            if found and found.peer_port
            else None
        )

    def measuring_device(self, reader: str, peer: str) -> str:
        """The device that reports what is in an input buffer; empty if none does."""
        wire = self.input_wire(reader, peer)
        return wire.peer_name if wire and wire.peer_device else ""

    def wires_of_element(self, device: str, direction: Direction, element: str) -> list[Wire]:
        """The wires on which an element of a device is read, "x", or commanded, "y"."""
        return [wire for wire in self.wires_to(device, direction) if wire.port.element(element)]

    def owners(self, device: Device) -> list[Wire]:
        """A wire of each subsystem that uses an effector or commands a receptor, namesake first."""
        direction: Direction | None = None if device.kind == "real_effector" else "y"
        found: dict[str, Wire] = {}
        for wire in self.wires_to(device.qualified_name, direction):
            found.setdefault(wire.subsystem.qualified_name, wire)
        return sorted(found.values(), key=lambda wire: wire.subsystem.name != device.name)

    @cached_property
    def shared_devices(self) -> frozenset[str]:
        """Devices with several owners; what these need of them is checked once there is one."""
        return frozenset(n for n, device in self.devices.items() if len(self.owners(device)) > 1)
