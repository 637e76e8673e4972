"""What pictures of any specification have: each part once, and the same text each time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator

from specc.model import expr as m
from specc.model.fsm import Function
from specc.model.system import Subsystem, System
from specc.tools.graph import Diagram
from specc.tools.graph.dot import as_dot
from specc.tools.graph.machine import flow, states
from specc.tools.graph.structure import frames, inside, structure


def every_part_is_drawn_once(system: System) -> None:
    """In the picture of the whole; subsystems and functions each have their own."""
    whole = structure(system)
    parts = [*system.subsystems, *system.devices]
    known = {part.qualified_name for part in parts}
    if len(known) < len(parts):
        return  # names that stand for two parts are an error
    _are(_nodes(whole), {*known, *(end for way in _ways(system) for end in way)})
    _are(_arcs(whole), (f"{tail} -> {head}" for tail, head in _ways(system)))
    _is_sound(whole)
    for agent in system.agents:
        _is_sound(structure(system, agent))
    everything = frames(system, system.subsystems)
    assert {name for name, _ in system.frames} <= set(_nodes(everything))
    _is_sound(everything)
    for subsystem in system.subsystems:
        _of_one(system, subsystem)


def _of_one(system: System, subsystem: Subsystem) -> None:
    machine = states(subsystem)
    _are(_nodes(machine), (state.name for state in subsystem.states))
    _are(_arcs(machine), map(str, range(len(subsystem.transitions))))
    _is_sound(machine)
    inner = inside(system, subsystem)
    elements = [f"{p.direction}.{p.peer}.{e.name}" for p in subsystem.ports for e in p.elements]
    _are(_nodes(inner), [*elements, *(kept.name for kept in subsystem.memory)])
    _is_sound(inner)
    for function in subsystem.functions:
        drawn = flow(subsystem, function.name, [function])
        targets = [f"{function.name}: {item.target}" for item in function.assignments]
        notes = [name for row in drawn.notes for name in row.covers]
        rows = [name for node in drawn.nodes for row in node.rows for name in row.covers]
        _are([*_nodes(drawn), *notes, *rows], [*targets, *_read(subsystem, function)])
        _is_sound(drawn)


def _ways(system: System) -> set[tuple[str, str]]:
    """The two ends of all that is sent, sender first."""
    return {
        ends if port.direction == "y" else ends[::-1]
        for subsystem in system.subsystems
        for port in subsystem.ports
        for ends in [(subsystem.qualified_name, port.other_end)]
    }


def _read(subsystem: Subsystem, function: Function) -> set[str]:
    """Inputs and memory that a function reads, also by way of lets."""
    lets = {let.name: let.value for let in subsystem.lets}
    found: set[str] = set()
    left = [item.value for item in function.assignments]
    seen: set[str] = set()
    while left:
        for node in m.walk(left.pop()):
            if isinstance(node, m.Input):
                found.add(f"x.{node.peer}.{node.element}")
            elif isinstance(node, m.MemoryRef):
                found.add(node.name)
            elif isinstance(node, m.LetRef) and node.name in lets and node.name not in seen:
                seen.add(node.name)
                left.append(lets[node.name])
    return found


def _nodes(diagram: Diagram) -> list[str]:
    return [name for node in diagram.all_nodes for name in node.covers]


def _arcs(diagram: Diagram) -> list[str]:
    return [name for arc in diagram.arcs for name in arc.covers]


def _are(drawn: Iterable[str], wanted: Iterable[str]) -> None:
    assert Counter(drawn) == Counter(wanted)


def _is_sound(diagram: Diagram) -> None:
    """Arcs end at nodes, nodes have names of their own, and the text is told by the diagram."""
    names = [node.id for node in diagram.all_nodes]
    assert len(set(names)) == len(names)
    ends = {end for arc in diagram.arcs for end in (arc.tail, arc.head)}
    assert ends <= set(names)
    text = as_dot(diagram)
    assert text == as_dot(diagram)
    assert len(list(_arrows(text))) == len(diagram.arcs)


def _arrows(text: str) -> Iterator[str]:
    return (line for line in text.splitlines() if line.startswith('  "') and '" -> "' in line)
