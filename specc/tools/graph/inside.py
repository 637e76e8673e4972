"""The inner structure of a subsystem: buffers, memory and functions (Figs 9, 16, 20)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics.phrases import common_stem
from specc.model.system import Device, Element, Memory, Port, Subsystem, System
from specc.model.wires import Wire, Wires
from specc.tools.graph.diagram import (
    Arc,
    Box,
    Cells,
    Cluster,
    Diagram,
    Points,
    TextLine,
    TextRun,
    broken,
    equations,
    line,
)
from specc.tools.graph.names import (
    AgentFamily,
    copies,
    is_named,
    rate,
    span,
    symbol,
)

_WORK, _MEMORY = "behaviours", "memory"
_APART = "      "
"""A label without ink: what stands side by side is as far apart as the label is long."""
_TYPE, _FUNCTIONS, _TITLE = 38, 40, 22


def inside(system: System, subsystem: Subsystem) -> Diagram:
    """Buffers by what is at their other end, which stands outside: the control subsystem above."""
    copied = {agent.name: each for each in copies(system) for agent in each.agents}
    nodes, others = [_work(subsystem)], []
    arcs: list[Arc] = []
    for wires in _together(subsystem, system, copied):
        end, ports = wires[0].peer, [wire.port for wire in wires]
        buffer, other = _buffer(ports), _other(wires)
        nodes.append(buffer)
        others.append(other)
        arcs += _ways(other, buffer, ports, above=_is_control(end))
    levels = []
    if subsystem.memory:
        nodes.append(_memory(subsystem))
        arcs.append(Arc(_WORK, _MEMORY, (line(_APART),), points="both"))
        levels.append((_WORK, _MEMORY))
    note = rate(subsystem.rate_hz) if subsystem.has_rate else ""
    head = (
        *symbol(subsystem),
        TextRun(f"  {subsystem.title}", "name"),
        TextRun(f"  {note}", "note"),
    )
    group = Cluster(subsystem.qualified_name, (head,), tuple(nodes))
    return Diagram(subsystem.qualified_name, tuple(others), tuple(arcs), (group,), tuple(levels))


def _together(
    subsystem: Subsystem, system: System, copied: dict[str, AgentFamily]
) -> list[list[Wire]]:
    """Wires by what is at their other end; copies of a part are one."""
    found: dict[object, list[Wire]] = {}
    for wire in Wires(system.agents).wires_of(subsystem):
        end, key = wire.peer, wire.port.peer
        whole = end and (copied[end.agent].name, end.place.file, end.place.route)
        found.setdefault(whole or key, []).append(wire)
    return list(found.values())


def _is_control(end: Subsystem | Device | None) -> bool:
    return end is not None and end.kind == "control"


def _ways(other: Box, buffer: Box, ports: list[Port], *, above: bool) -> Iterator[Arc]:
    """What comes in and goes out, through the buffer; a part that is above has arcs downwards."""
    directions = {port.direction for port in ports}
    points: Points = "down" if ("x" in directions) == above else "up"
    if len(directions) > 1:
        points = "both"
    route = (other.id, buffer.id, _WORK) if above else (_WORK, buffer.id, other.id)
    yield Arc(route[0], route[1], points=points)
    yield Arc(route[1], route[2], points=points)


def _buffer(ports: list[Port]) -> Box:
    elements: dict[tuple[str, str], Element] = {}
    for port in ports:
        for element in port.elements:
            elements.setdefault((port.direction, element.name), element)
    rows = tuple(
        Cells((line(direction, "italic"), *_declared(elements[direction, name])))
        for direction, name in sorted(elements, key=lambda key: key[0])
    )
    covers = tuple(f"{p.direction}.{p.peer}.{e.name}" for p in ports for e in p.elements)
    names = list(dict.fromkeys(port.peer for port in ports))
    head = (TextRun("buffers  ", "italic"), TextRun(span(names)))
    return Box(f"buffers {names[0]}", "table", (head,), rows or _nothing(), covers)


def _declared(part: Element | Memory) -> tuple[TextLine, TextLine]:
    """Its name and its type."""
    kind = broken(str(part.type), _TYPE, "note", most=1) or (line(""),)
    return (TextRun(part.name, "name"), *equations(part.trace.eq)), kind[0]


def _nothing() -> tuple[Cells, ...]:
    return (Cells((line("nothing yet", "note"),)),)


def _memory(subsystem: Subsystem) -> Box:
    rows = tuple(Cells(_declared(each)) for each in subsystem.memory)
    covers = tuple(each.name for each in subsystem.memory)
    return Box(_MEMORY, "table", (line("memory", "italic"),), rows, covers)


def _work(subsystem: Subsystem) -> Box:
    """The behaviours with their functions."""
    rows: list[Cells] = []
    for behaviour in dict.fromkeys(state.behaviour for state in subsystem.states):
        named = [f.name for f in behaviour.functions if is_named(f)]
        first, *rest = broken(", ".join(named), _FUNCTIONS) or (line(" "),)
        head = (TextRun(behaviour.name, "italic"), *equations(behaviour.trace.eq))
        rows += [Cells((head, first)), *(Cells((line(" "), each)) for each in rest)]
    title = line("behaviours and their functions", "italic")
    return Box(_WORK, "table", (title,), tuple(rows) or _nothing())


def _other(wires: list[Wire]) -> Box:
    id, end = f"other {wires[0].port.peer}", wires[0].peer
    if end is None:
        return Box(id, "missing", (line(wires[0].peer_name), line("not there", "note")))
    agents = list(dict.fromkeys(wire.peer_name.partition(".")[0] for wire in wires))
    return Box(id, "other", (symbol(end, common_stem(agents)), *broken(end.title, _TITLE)))
