"""What the model adds to the text: types of symbols, the ends of connections, peers, the task."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from specc.lsp.python_names import enums_in_python
from specc.lsp.symbols import Key
from specc.model.system import Device, Element, Subsystem, System
from specc.model.types import Type
from specc.source import Place


@dataclass(slots=True)
class Links:
    """Definitions are named by file and route, so that they outlive the model."""

    types: dict[Key, Type] = field(default_factory=dict)
    ends: list[tuple[Key, Key]] = field(default_factory=list)
    peers: dict[Key, Key] = field(default_factory=dict)
    """Key of a buffer (owner, direction, peer) -> subsystem or device at the other end."""
    named: dict[Key, Key] = field(default_factory=dict)
    """Key of a buffer -> what has the name of its peer: an agent, not its control subsystem."""
    agents: dict[str, Key] = field(default_factory=dict)
    bindings: dict[Key, Key] = field(default_factory=dict)
    subsystems: dict[str, Key] = field(default_factory=dict)
    states: dict[str, Key] = field(default_factory=dict)
    """States of the subsystem that the task counts; so with its memory."""
    memory: dict[str, Key] = field(default_factory=dict)
    in_python: dict[str, str] = field(default_factory=dict)
    """Enums whose members Python code knows by their names -> the code."""


def links_of(system: System | None) -> Links:
    """The links of a system; none where there is no system."""
    links = Links()
    if system is None:
        return links
    for constant in system.constants:
        links.types[key_of(constant.place)] = constant.value.type
    links.agents = {agent.name: key_of(agent.place) for agent in system.agents}
    links.in_python = enums_in_python(system)
    parts: dict[str, Subsystem | Device] = {s.qualified_name: s for s in system.subsystems}
    links.subsystems = {name: key_of(part.place) for name, part in parts.items()}
    parts |= {d.qualified_name: d for d in system.devices}
    for subsystem in system.subsystems:
        _types(links, subsystem)
        _connections(links, subsystem, parts)
    _bindings(links, system, parts)
    _task(links, system)
    return links


def key_of(place: Place) -> Key:
    """What a definition is known by."""
    return place.file, place.route


def _types(links: Links, subsystem: Subsystem) -> None:
    for memory in subsystem.memory:
        links.types[key_of(memory.place)] = memory.type
    for let in subsystem.lets:
        links.types[key_of(let.place)] = let.value.type
    for port in subsystem.ports:
        for element in port.elements:
            links.types[key_of(element.place)] = element.type


def _connections(links: Links, subsystem: Subsystem, parts: dict[str, Subsystem | Device]) -> None:
    for port in subsystem.ports:
        other = parts.get(port.other_end)
        if other is None:
            continue
        links.peers.setdefault(key_of(port.place), key_of(other.place))
        agent = links.agents.get(other.agent) if other.agent != subsystem.agent else None
        links.named.setdefault(key_of(port.place), agent or key_of(other.place))
        far = {e.name: e for e in _elements(other, subsystem.qualified_name, port.direction)}
        for element in port.elements:
            if element.name in far:
                links.ends.append((key_of(element.place), key_of(far[element.name].place)))


def _elements(other: Subsystem | Device, name: str, direction: str) -> Iterator[Element]:
    """The elements at the far end of a port: a device reports in y what is read in x."""
    if isinstance(other, Device):
        yield from other.y if direction == "x" else other.x
        return
    for port in other.ports:
        if port.other_end == name and port.direction != direction:
            yield from port.elements


def _bindings(links: Links, system: System, parts: dict[str, Subsystem | Device]) -> None:
    for binding in system.plant.bindings if system.plant else ():
        device = parts.get(binding.device)
        for element in (*device.x, *device.y) if isinstance(device, Device) else ():
            if element.name == binding.element:
                links.types[key_of(element.place)] = element.type
                links.bindings[key_of(binding.place)] = key_of(element.place)


def _task(links: Links, system: System) -> None:
    for subsystem in system.subsystems:
        if system.task is not None and subsystem.qualified_name == system.task.subsystem:
            links.states = {s.name: key_of(s.place) for s in subsystem.states}
            links.memory = {m.name: key_of(m.place) for m in subsystem.memory}
