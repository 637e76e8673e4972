"""Which definitions of the main file serve its agents, directly or through others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.facts.references import expressions
from specc.model.expr import Call, ConstantRef, Expr, FileRef, walk
from specc.model.system import Definition, System


def unused(system: System) -> Iterator[tuple[Definition, tuple[Definition, ...]]]:
    """What serves nothing and nobody, each with the others that serve only it."""
    edges = _edges(system)
    used = _closure(_needed_by_agents(system), edges)
    idle = {d.label: d for d in system.definitions if d.label not in used}
    inner = {label for one in idle for label in edges.get(one, ()) if label != one}
    for label, definition in idle.items():
        if label not in inner:
            behind = _closure(edges.get(label, ()), edges)
            yield definition, tuple(idle[other] for other in idle if other in behind)


def _needed_by_agents(system: System) -> set[str]:
    found = set(system.named_in_agents)
    for subsystem in system.subsystems:
        for expression in expressions(subsystem):
            found |= _labels(expression)
    for device in system.devices:
        for _, safe in device.safe:
            found |= _labels(safe.value) | (_labels(safe.otherwise) if safe.otherwise else set())
    return found


def _edges(system: System) -> dict[str, frozenset[str]]:
    edges = {d.label: d.names for d in system.definitions}
    for constant in system.constants:
        label = f"constant {constant.name}"
        edges[label] = edges.get(label, frozenset()) | _labels(constant.value)
    return edges


def _labels(expression: Expr) -> frozenset[str]:
    found = set()
    for node in walk(expression):
        if isinstance(node, Call):
            found.add(f"operator {node.operator}")
        elif isinstance(node, ConstantRef):
            found.add(f"constant {node.name}")
        elif isinstance(node, FileRef):
            found.add(f"file {node.name}")
    return frozenset(found)


def _closure(start: Iterable[str], edges: dict[str, frozenset[str]]) -> set[str]:
    found, open_ = set(start), list(start)
    while open_:
        new = edges.get(open_.pop(), frozenset()) - found
        found |= new
        open_ += new
    return found
