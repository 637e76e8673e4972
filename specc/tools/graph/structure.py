"""The structure of a system or an agent: subsystems, devices and what they send (Figs 1, 6, 8)."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace

from specc.diagnostics.phrases import common_stem
from specc.model.system import Agent, Device, Subsystem, System
from specc.model.wires import Wires
from specc.reachable import grouped, reachable
from specc.tools.graph.diagram import (
    Arc,
    Box,
    Cluster,
    Diagram,
    TextLine,
    TextRun,
    broken,
    joined,
    line,
)
from specc.tools.graph.names import AgentFamily, copies, rate, span, symbol

_COLUMNS = 22
_ABREAST = 2
_LEVELS = {
    "control": 0,
    "virtual_effector": 1,
    "virtual_receptor": 1,
    "real_effector": 2,
    "real_receptor": 2,
}


_Copies = list[Subsystem] | list[Device]
"""A part of an agent in all copies of it."""


@dataclass(frozen=True, slots=True)
class _Ends:
    """The node and the level of each end of buffers, by qualified name."""

    nodes: dict[str, str]
    levels: dict[str, int]

    def add(self, part: _Copies) -> None:
        """All copies of a part are the node of the first."""
        for each in part:
            self.nodes[each.qualified_name] = part[0].qualified_name
            self.levels[each.qualified_name] = _LEVELS[each.kind]


def structure(system: System, agent: Agent | None = None) -> Diagram:
    """All agents, or one alone with the subsystems of others that it talks to."""
    shown = copies(system) if agent is None else [AgentFamily((agent,))]
    ends = _Ends({}, {})
    alone = tuple(_alone(each, ends) for each in shown if _is_alone(each))
    groups = tuple(_group(each, ends) for each in shown if not _is_alone(each))
    wires = Wires(system.agents)
    sent = _sent([a for each in shown for a in each.agents], wires)
    others = tuple(_others(wires, sent, ends))
    arcs = list(_arcs(sent, ends))
    arcs += _stacked(dict.fromkeys(ends.nodes.values()), arcs)
    levels = tuple(
        tuple(level) for group in groups for level in _beside(group, ends) if len(level) > 1
    )
    return Diagram(system.name, (*alone, *others), tuple(arcs), groups, levels)


def _group(of: AgentFamily, ends: _Ends) -> Cluster:
    parts: list[_Copies] = [*of.subsystems(), *of.devices()]
    for part in parts:
        ends.add(part)
    inside = len(of.agents)
    nodes = tuple(_node(part, inside) for part in parts)
    return Cluster(of.agents[0].name, _head(of, _COLUMNS * 2), nodes)


def _is_alone(of: AgentFamily) -> bool:
    """Whether an agent is nothing but a control subsystem."""
    return all(len(agent.subsystems) == 1 and not agent.devices for agent in of.agents)


def _alone(of: AgentFamily, ends: _Ends) -> Box:
    (part,) = of.subsystems()
    ends.add(part)
    node = _node(part, len(of.agents))
    return replace(node, lines=(*_head(of, _COLUMNS), *node.lines))


def _head(of: AgentFamily, columns: int) -> tuple[TextLine, ...]:
    """Name, kind and title of an agent, and how many copies it stands for."""
    first, number = of.agents[0], len(of.agents)
    many = (line(f"{number} copies", "note"),) if number > 1 else ()
    name = TextRun(of.name, "name"), TextRun(f"  {first.kind}" if first.kind else "", "name")
    return name, *broken(first.title, columns, "note"), *many


def _node(part: _Copies, agents: int) -> Box:
    first = part[0]
    whose = common_stem(list(dict.fromkeys(each.agent for each in part)))
    lines: list[TextLine] = [symbol(first, whose)]
    if len(part) > agents:
        own = [each.name for each in part[: len(part) // agents]]
        lines.append(line(f"{span(own)}: {len(own)} copies", "note"))
    lines += broken(first.title, _COLUMNS)
    if isinstance(first, Subsystem) and first.has_rate:
        lines.append(line(rate(first.rate_hz), "note"))
    names = tuple(each.qualified_name for each in part)
    return Box(
        first.qualified_name,
        "device" if isinstance(first, Device) else "subsystem",
        tuple(lines),
        covers=names,
    )


def _sent(agents: list[Agent], wires: Wires) -> dict[tuple[str, str], list[str]]:
    """What goes from one qualified name to another: the elements that either end declares."""
    found: dict[tuple[str, str], dict[str, None]] = {}
    for wire in (w for agent in agents for s in agent.subsystems for w in wires.wires_of(s)):
        here, there = wire.subsystem.qualified_name, wire.peer_name
        way = (here, there) if wire.port.direction == "y" else (there, here)
        found.setdefault(way, {}).update((e.name, None) for e in wire.port.elements)
    return {way: list(names) for way, names in found.items()}


def _others(wires: Wires, sent: Collection[tuple[str, str]], ends: _Ends) -> Iterator[Box]:
    """Ends of buffers that are in no agent that is shown."""
    for name in dict.fromkeys(name for way in sent for name in way):
        if name in ends.nodes:
            continue
        ends.nodes[name], part = name, wires.part(name)
        ends.levels[name] = 0
        if part is None:
            yield Box(name, "missing", (line(name), line("not there", "note")), covers=(name,))
        else:
            yield Box(name, "other", (symbol(part), *broken(part.title, _COLUMNS)), covers=(name,))


def _arcs(sent: dict[tuple[str, str], list[str]], ends: _Ends) -> Iterator[Arc]:
    """An arc for each way between two nodes, with all that goes there."""
    order = {name: number for number, name in enumerate(ends.nodes.values())}
    together = grouped(((ends.nodes[a], ends.nodes[b]), (a, b)) for a, b in sent)
    for (tail, head), ways in together.items():
        names = dict.fromkeys(name for way in ways for name in sent[way])
        covers = tuple(f"{a} -> {b}" for a, b in ways)
        texts = joined(names, _COLUMNS)
        if (ends.levels[tail], order[tail]) > (ends.levels[head], order[head]):
            yield Arc(head, tail, texts, points="up", covers=covers)
        else:
            yield Arc(tail, head, texts, covers=covers)


def _stacked(nodes: Iterable[str], arcs: list[Arc]) -> Iterator[Arc]:
    """What puts parts that do not talk to each other into rows of a few, one above the other."""
    left = dict.fromkeys(nodes)
    ends = [(arc.tail, arc.head) for arc in arcs]
    beside = grouped([*ends, *(pair[::-1] for pair in ends)])
    parts: list[list[str]] = []
    while left:
        part = reachable([next(iter(left))], lambda node: beside.get(node, ()))
        parts.append([node for node in left if node in part])
        left = {node: None for node in left if node not in part}
    for above, below in zip(parts, parts[_ABREAST:], strict=False):
        yield Arc(above[-1], below[0], stroke="none")


def _beside(group: Cluster, ends: _Ends) -> Iterator[list[str]]:
    for level in (1, 2):
        yield [node.id for node in group.nodes if ends.levels[node.id] == level]
