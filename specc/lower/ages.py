"""What a run has to know to tell how old values are: what they are computed from, what is allowed.

Nothing of it is there where nobody asks for an age or limits one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.analysis.dataflow import Ages, InputNode, ReadEdge
from specc.analysis.reads import nodes
from specc.lower.module import buffer_names
from specc.lower.names import Imports, call, given, literal
from specc.model.expr import Lag
from specc.model.system import Element, Subsystem, System
from specc.reachable import grouped, reachable


def ages_plan(system: System, ages: Ages, imports: Imports) -> dict[str, tuple[str, ...]]:
    """Calls of `Behind`, `MaxAge` and `MaxCommandAge`; nothing for a system that asks for none."""
    limits = list(_limits(system, ages, imports))
    commands = list(_commands(system, ages, imports))
    asked = {*_asked(system), *(node for node, _ in limits), *(node for node, _ in commands)}
    found = {
        "behind": tuple(_behind(system, ages, asked, imports)),
        "limits": tuple(text for _, text in limits),
        "commands": tuple(text for _, text in commands),
    }
    if not any(found.values()):
        return {}
    imports.own("AgeRules")
    return found


def _asked(system: System) -> Iterator[InputNode]:
    """The inputs whose age is asked for."""
    for subsystem in system.subsystems:
        for part in nodes(subsystem):
            if isinstance(part, Lag) and part.name == "age":
                yield InputNode(subsystem.qualified_name, part.input.peer, part.input.element)


def _limits(system: System, ages: Ages, imports: Imports) -> Iterator[tuple[InputNode, str]]:
    """The inputs whose age is limited, and whose source is known."""
    for subsystem in system.subsystems:
        for (peer, name), element in subsystem.inputs.items():
            node = InputNode(subsystem.qualified_name, peer, name)
            if element.max_age_s is not None and ages.oldest(node) is not None:
                told = tuple(_limit(subsystem, node, element, ages))
                if told:
                    yield node, call(imports.own("MaxAge"), told)


def _limit(subsystem: Subsystem, node: InputNode, element: Element, ages: Ages) -> Iterator[str]:
    """Arguments of `MaxAge`; nothing for an input that is not read."""
    reads = ages.sources.reads_of(node.reader)
    states = reads.reachable_states if reads else []
    name = node.peer, node.element
    asked = tuple(
        s.name for s in states if reads and name in {r.input for r in reads.read_by_conditions(s)}
    )
    used = tuple(
        s.name for s in states if reads and name in {r.input for r in reads.read_by_functions(s)}
    )
    if not asked and not used:
        return
    assert element.max_age_s is not None  # callers looked
    yield literal(node.reader)
    yield literal(buffer_names(subsystem.inputs)[name])
    yield literal(f"x.{node.peer}.{node.element}")
    yield literal(float(element.max_age_s))
    fresh, computed = ages.sources.only_on_arrival(node), not ages.is_measured(node)
    yield from given({"asked": asked, "used": used, "fresh": fresh, "computed": computed})


def _commands(system: System, ages: Ages, imports: Imports) -> Iterator[tuple[InputNode, str]]:
    """The commands whose age a device limits."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    for device in system.devices:
        for element in device.x:
            node = InputNode(device.qualified_name, "", element.name)
            sent = ages.sources.sender(node)
            if element.max_age_s is None or sent is None or ages.oldest(node) is None:
                continue
            told = literal(sent[0]), literal(buffer_names(subsystems[sent[0]].outputs)[sent[1]])
            limit = literal(float(element.max_age_s)), literal(node.short)
            computed = given({"computed": not ages.is_measured(node)})
            yield node, call(imports.own("MaxCommandAge"), (*told, *limit, *computed))


def _behind(
    system: System, ages: Ages, asked: Iterable[InputNode], imports: Imports
) -> Iterator[str]:
    """What outputs are computed from that values with an age come from, directly or not."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    known = {node: ages.reads_by_state(node) for node in asked}

    def above(node: InputNode) -> Iterator[InputNode]:
        known.setdefault(node, ages.reads_by_state(node))
        return (one for each in known[node].values() for one, _ in each)

    found: list[tuple[str, str, str]] = []
    for node in reachable(sorted(known), above):
        sent = ages.sources.sender(node)
        if not known[node] or sent is None:
            continue
        sender = subsystems[sent[0]]
        output = buffer_names(sender.outputs)[sent[1]]
        for states, edges in _alike(known[node]):
            told = [literal(sender.qualified_name), literal(output), literal(states)]
            told += _inputs(sender, edges, computed=not ages.is_measured(node))
            found.append((sender.qualified_name, output, call(imports.own("Behind"), told)))
    yield from (text for _, _, text in sorted(found))


def _alike(by_state: dict[str, list[ReadEdge]]) -> Iterator[tuple[tuple[str, ...], list[ReadEdge]]]:
    """The states with what is read there, those that read the same together."""
    groups = grouped((tuple(edges), state) for state, edges in by_state.items())
    return ((tuple(states), list(edges)) for edges, states in groups.items() if edges)


def _inputs(sender: Subsystem, edges: list[ReadEdge], *, computed: bool) -> Iterator[str]:
    names = buffer_names(sender.inputs)
    held = tuple(names[node.peer, node.element] for node, fresh in edges if not fresh)
    fresh = tuple(names[node.peer, node.element] for node, fresh in edges if fresh)
    return given({"held": held, "fresh": fresh, "computed": computed})
