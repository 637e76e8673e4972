"""Pictures of structure: agents (Figs 1, 6, 8), a subsystem (Figs 9, 16, 20), frames (Fig. 7)."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import replace

from specc.diagnostics.phrases import common_stem
from specc.model.system import (
    Agent,
    Device,
    Element,
    Memory,
    Port,
    Subsystem,
    System,
)
from specc.model.types import Pose, Record, Type
from specc.model.wires import Wire, Wires
from specc.reachable import grouped, reachable
from specc.tools.graph.diagram import (
    AgentFamily,
    Arc,
    Box,
    Cells,
    Cluster,
    Diagram,
    Points,
    TextLine,
    TextRun,
    agent_families,
    comma_lines,
    equations,
    is_named,
    line,
    rate,
    span,
    symbol,
    wrap_lines,
)

_COLUMNS = 22
_LEVELS = {
    "control": 0,
    "virtual_effector": 1,
    "virtual_receptor": 1,
    "real_effector": 2,
    "real_receptor": 2,
}
_ROW = 2
"""How many parts that do not talk to each other stand in a row."""

# The structure of a system or an agent: subsystems, devices and what they send.


def structure(system: System, agent: Agent | None = None) -> Diagram:
    """All agents, or a single one with the subsystems of others that it talks to."""
    families = agent_families(system) if agent is None else [AgentFamily((agent,))]
    node_of: dict[str, Box] = {}
    """The node of each end of buffers, by qualified name; copies of a part are one node."""
    levels: dict[str, int] = {}
    single, clusters = [], []
    for family in sorted(families, key=lambda each: not each.is_single):
        boxes = []
        for copies in family.parts():
            boxes.append(_part(copies, len(family.agents)))
            node_of |= dict.fromkeys((each.qualified_name for each in copies), boxes[-1])
            levels[boxes[-1].id] = _LEVELS[copies[0].kind]
        if family.is_single:
            single.append(replace(boxes[0], lines=(*_head(family, _COLUMNS), *boxes[0].lines)))
        else:
            name = family.agents[0].name
            clusters.append(Cluster(name, _head(family, _COLUMNS * 2), tuple(boxes)))
    wires = Wires(system.agents)
    sent = _sent([agent for family in families for agent in family.agents], wires)
    for name in dict.fromkeys(name for ends in sent for name in ends):
        if name not in node_of:
            node_of[name] = _outside(name, wires.part(name))
            single.append(node_of[name])
    order = list(dict.fromkeys(box.id for box in node_of.values()))
    rank = {id: (levels.get(id, 0), place) for place, id in enumerate(order)}
    arcs = []
    grouped_ends = grouped(((node_of[a].id, node_of[b].id), (a, b)) for a, b in sent)
    for (tail, head), ends in grouped_ends.items():
        texts = comma_lines(dict.fromkeys(name for each in ends for name in sent[each]), _COLUMNS)
        covers = tuple(f"{a} -> {b}" for a, b in ends)
        if rank[tail] > rank[head]:
            arcs.append(Arc(head, tail, texts, points="up", covers=covers))
        else:
            arcs.append(Arc(tail, head, texts, covers=covers))
    arcs += _stacked(order, arcs)
    rows = (
        tuple(box.id for box in cluster.nodes if levels[box.id] == level)
        for cluster in clusters
        for level in (1, 2)
    )
    beside = tuple(row for row in rows if len(row) > 1)
    return Diagram(system.name, tuple(single), tuple(arcs), tuple(clusters), beside)


def _head(family: AgentFamily, columns: int) -> tuple[TextLine, ...]:
    """Name, kind and title of an agent, and how many copies it stands for."""
    first, number = family.agents[0], len(family.agents)
    name = TextRun(family.name, "name"), TextRun(f"  {first.kind}" if first.kind else "", "name")
    copies = (line(f"{number} copies", "note"),) if number > 1 else ()
    return name, *wrap_lines(first.title, columns, "note"), *copies


def _part(copies: list[Subsystem] | list[Device], agents: int) -> Box:
    """A part of an agent, in all copies of it."""
    first, names = copies[0], tuple(each.qualified_name for each in copies)
    lines = [symbol(first, common_stem(list(dict.fromkeys(each.agent for each in copies))))]
    if len(copies) > agents:
        own = [each.name for each in copies[: len(copies) // agents]]
        lines.append(line(f"{span(own)}: {len(own)} copies", "note"))
    lines += wrap_lines(first.title, _COLUMNS)
    if isinstance(first, Device):
        return Box(names[0], "device", tuple(lines), covers=names)
    if first.has_rate:
        lines.append(line(rate(first.rate_hz), "note"))
    return Box(names[0], "subsystem", tuple(lines), covers=names)


def _sent(agents: list[Agent], wires: Wires) -> dict[tuple[str, str], dict[str, None]]:
    """The elements that either end declares, by the qualified names of sender and receiver."""
    found: dict[tuple[str, str], dict[str, None]] = {}
    for wire in (w for agent in agents for s in agent.subsystems for w in wires.wires_of(s)):
        ends = wire.subsystem.qualified_name, wire.peer_name
        way = ends if wire.port.direction == "y" else ends[::-1]
        found.setdefault(way, {}).update((e.name, None) for e in wire.port.elements)
    return found


def _outside(name: str, part: Subsystem | Device | None) -> Box:
    """An end of buffers in no agent that is shown."""
    if part is None:
        return Box(name, "missing", (line(name), line("not there", "note")), covers=(name,))
    return Box(name, "other", (symbol(part), *wrap_lines(part.title, _COLUMNS)), covers=(name,))


def _stacked(nodes: Iterable[str], arcs: Collection[Arc]) -> Iterator[Arc]:
    """Invisible arcs that put parts that do not talk to each other into rows."""
    rest = dict.fromkeys(nodes)
    ends = [(arc.tail, arc.head) for arc in arcs]
    beside = grouped([*ends, *(pair[::-1] for pair in ends)])
    parts: list[list[str]] = []
    while rest:
        part = reachable([next(iter(rest))], lambda node: beside.get(node, ()))
        parts.append([node for node in rest if node in part])
        rest = {node: None for node in rest if node not in part}
    for above, below in zip(parts, parts[_ROW:], strict=False):
        yield Arc(above[-1], below[0], stroke="none")


# The inner structure of a subsystem: buffers, memory and behaviours.

_WORK, _MEMORY = "behaviours", "memory"
_GAP = "      "
"""A label without ink: nodes side by side are as far apart as the label is long."""
_TYPE, _FUNCTIONS = 38, 40
_NOTHING = (Cells((line("nothing yet", "note"),)),)


def inside(system: System, subsystem: Subsystem) -> Diagram:
    """Buffers by what is at their other end, which stands outside: the control subsystem above."""
    family_of = {a.name: family for family in agent_families(system) for a in family.agents}
    by_end: dict[object, list[Wire]] = {}
    for wire in Wires(system.agents).wires_of(subsystem):
        end = wire.peer  # copies of a part are one
        key = end and (family_of[end.agent].name, end.place.file, end.place.route)
        by_end.setdefault(key or wire.port.peer, []).append(wire)
    nodes, others, arcs = [_behaviours(subsystem)], [], []
    for wires in by_end.values():
        ports = [wire.port for wire in wires]
        buffer, other = _buffer(ports), _other_end(wires)
        nodes.append(buffer)
        others.append(other)
        is_above = wires[0].peer is not None and wires[0].peer.kind == "control"
        route = (other.id, buffer.id, _WORK) if is_above else (_WORK, buffer.id, other.id)
        directions = {port.direction for port in ports}
        points: Points = "down" if ("x" in directions) == is_above else "up"
        points = "both" if len(directions) > 1 else points
        arcs += [Arc(*route[:2], points=points), Arc(*route[1:], points=points)]
    levels = []
    if subsystem.memory:
        rows = tuple(Cells(_name_and_type(each)) for each in subsystem.memory)
        covers = tuple(each.name for each in subsystem.memory)
        nodes.append(Box(_MEMORY, "table", (line("memory", "italic"),), rows, covers))
        arcs.append(Arc(_WORK, _MEMORY, (line(_GAP),), points="both"))
        levels.append((_WORK, _MEMORY))
    note = f"  {rate(subsystem.rate_hz) if subsystem.has_rate else ''}"
    title = TextRun(f"  {subsystem.title}", "name")
    head = (*symbol(subsystem), title, TextRun(note, "note"))
    name = subsystem.qualified_name
    cluster = Cluster(name, (head,), tuple(nodes))
    return Diagram(name, tuple(others), tuple(arcs), (cluster,), tuple(levels))


def _buffer(ports: list[Port]) -> Box:
    elements: dict[tuple[str, str], Element] = {}
    for port in ports:
        for element in port.elements:
            elements.setdefault((port.direction, element.name), element)
    rows = tuple(
        Cells((line(direction, "italic"), *_name_and_type(elements[direction, name])))
        for direction, name in sorted(elements, key=lambda key: key[0])
    )
    covers = tuple(f"{p.direction}.{p.peer}.{e.name}" for p in ports for e in p.elements)
    names = list(dict.fromkeys(port.peer for port in ports))
    head = (TextRun("buffers  ", "italic"), TextRun(span(names)))
    return Box(f"buffers {names[0]}", "table", (head,), rows or _NOTHING, covers)


def _name_and_type(part: Element | Memory) -> tuple[TextLine, TextLine]:
    """The name with its equations, and the type."""
    kind = wrap_lines(str(part.type), _TYPE, "note", most=1) or (line(""),)
    return (TextRun(part.name, "name"), *equations(part.trace.eq)), kind[0]


def _behaviours(subsystem: Subsystem) -> Box:
    """The behaviours with their functions."""
    rows: list[Cells] = []
    for behaviour in dict.fromkeys(state.behaviour for state in subsystem.states):
        named = [f.name for f in behaviour.functions if is_named(f)]
        first, *rest = wrap_lines(", ".join(named), _FUNCTIONS) or (line(" "),)
        head = (TextRun(behaviour.name, "italic"), *equations(behaviour.trace.eq))
        rows += [Cells((head, first)), *(Cells((line(" "), each)) for each in rest)]
    title = line("behaviours and their functions", "italic")
    return Box(_WORK, "table", (title,), tuple(rows) or _NOTHING)


def _other_end(wires: list[Wire]) -> Box:
    id, end = f"other {wires[0].port.peer}", wires[0].peer
    if end is None:
        return Box(id, "missing", (line(wires[0].peer_name), line("not there", "note")))
    agents = list(dict.fromkeys(wire.peer_name.partition(".")[0] for wire in wires))
    return Box(id, "other", (symbol(end, common_stem(agents)), *wrap_lines(end.title, _COLUMNS)))


# The coordinate frames and the poses of one in another.

_POSES_COLUMNS, _MOST_POSES = 26, 8
_NamedPose = tuple[tuple[str, str], str]
"""Parent and child, and the name of what has that type."""


def frames(system: System, subsystems: tuple[Subsystem, ...]) -> Diagram:
    """All frames; an arc from A to B is the pose of B in A, by whatever has this type.

    Constants are drawn solid. Dashed are poses that change, of these subsystems.
    """
    constants = (*system.constants, *(c for s in system.subsystems for c in s.constants))
    fixed = [(constant.name, constant.value.type) for constant in constants]
    varying: list[tuple[str, Type]] = []
    for each in subsystems:
        varying += [(e.name, e.type) for port in each.ports for e in port.elements]
        varying += [(memory.name, memory.type) for memory in each.memory]
        varying += [(let.name, let.value.type) for let in each.lets]
    solid, dashed = (
        grouped(pose for name, type_ in parts for pose in _poses(name, type_))
        for parts in (fixed, varying)
    )
    described = dict(system.frames)
    names = dict.fromkeys((*described, *(name for pair in (*solid, *dashed) for name in pair)))
    nodes = tuple(
        Box(
            n,
            "frame",
            (line(n, "name"), *wrap_lines(described.get(n, ""), 16, "note")),
            covers=(n,),
        )
        for n in names
    )
    arcs = [Arc(*pair, _pose_names(found)) for pair, found in solid.items()]
    arcs += [Arc(*pair, _pose_names(found), "dashed") for pair, found in dashed.items()]
    notes = (
        Cells((line("solid", "italic"), line("constant"))),
        Cells((line("dashed", "italic"), line("changes"))),
    )
    return Diagram(system.name, nodes, tuple(arcs), notes=notes if arcs else ())


def _poses(name: str, kind: Type, depth: int = 3) -> Iterator[_NamedPose]:
    """A pose by its name, one in a record by that of its field; lists stand for their items."""
    if isinstance(kind, Pose):
        yield (kind.parent, kind.child), name
    elif not isinstance(kind, Record):
        for part in kind.parts:
            yield from _poses(name, part, depth)
    elif depth:
        for field, inner in kind.fields:
            yield from _poses(f"{name}.{field}", inner, depth - 1)


def _pose_names(found: list[str]) -> tuple[TextLine, ...]:
    names = list(dict.fromkeys(found))
    more = [f"and {len(names) - _MOST_POSES} more"] if len(names) > _MOST_POSES else []
    return comma_lines((*names[:_MOST_POSES], *more), _POSES_COLUMNS)
