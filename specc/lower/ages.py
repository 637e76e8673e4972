"""What a run has to know to tell how old values are: what they are computed from, what is allowed.

Nothing of it is there where nobody asks for an age or limits one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.analysis.dataflow import Ages, InputNode, ReadEdge
from specc.analysis.reads import nodes
from specc.lower.module import buffer_names
from specc.lower.names import Imports, call, keyword_arguments, literal
from specc.model.expr import Lag
from specc.model.system import Element, Subsystem, System
from specc.reachable import grouped, reachable


def ages_plan(system: System, ages: Ages, imports: Imports) -> dict[str, tuple[str, ...]]:
    """Calls of `Behind`, `MaxAge` and `MaxCommandAge`; nothing for a system that asks for none."""
    limits = list(_limits(system, ages, imports))
    commands = list(_commands(system, ages, imports))
    inputs = {*_aged_inputs(system), *(node for node, _ in limits), *(node for node, _ in commands)}
    found = {
        "behind": tuple(_age_sources(system, ages, inputs, imports)),
        "limits": tuple(text for _, text in limits),
        "commands": tuple(text for _, text in commands),
    }
    if not any(found.values()):
        return {}
    imports.runtime_name("AgeRules")
    return found


def _aged_inputs(system: System) -> Iterator[InputNode]:
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
                arguments = tuple(_limit(subsystem, node, element, ages))
                if arguments:
                    yield node, call(imports.runtime_name("MaxAge"), arguments)


def _limit(subsystem: Subsystem, node: InputNode, element: Element, ages: Ages) -> Iterator[str]:
    """Arguments of `MaxAge`; nothing for an input that is not read."""
    reads = ages.sources.reads_of(node.reader)
    states = reads.reachable_states if reads else []
    name = node.peer, node.element
    in_conditions = tuple(
        s.name for s in states if reads and name in {r.input for r in reads.read_by_conditions(s)}
    )
    in_functions = tuple(
        s.name for s in states if reads and name in {r.input for r in reads.read_by_functions(s)}
    )
    if not in_conditions and not in_functions:
        return
    assert element.max_age_s is not None  # callers looked
    yield literal(node.reader)
    yield literal(buffer_names(subsystem.inputs)[name])
    yield literal(f"x.{node.peer}.{node.element}")
    yield literal(float(element.max_age_s))
    fresh, computed = ages.sources.only_on_arrival(node), not ages.is_measured(node)
    yield from keyword_arguments(
        {"asked": in_conditions, "used": in_functions, "fresh": fresh, "computed": computed}
    )


def _commands(system: System, ages: Ages, imports: Imports) -> Iterator[tuple[InputNode, str]]:
    """The commands whose age a device limits."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    for device in system.devices:
        for element in device.x:
            node = InputNode(device.qualified_name, "", element.name)
            sent = ages.sources.sender(node)
            if element.max_age_s is None or sent is None or ages.oldest(node) is None:
                continue
            command = literal(sent[0]), literal(buffer_names(subsystems[sent[0]].outputs)[sent[1]])
            limit = literal(float(element.max_age_s)), literal(node.short)
            computed = keyword_arguments({"computed": not ages.is_measured(node)})
            yield node, call(imports.runtime_name("MaxCommandAge"), (*command, *limit, *computed))


def _age_sources(
    system: System, ages: Ages, inputs: Iterable[InputNode], imports: Imports
) -> Iterator[str]:
    """What outputs are computed from that values with an age come from, directly or not."""
    subsystems = {s.qualified_name: s for s in system.subsystems}
    known = {node: ages.reads_by_state(node) for node in inputs}

    def sources(node: InputNode) -> Iterator[InputNode]:
        known.setdefault(node, ages.reads_by_state(node))
        return (one for each in known[node].values() for one, _ in each)

    found: list[tuple[str, str, str]] = []
    for node in reachable(sorted(known), sources):
        sent = ages.sources.sender(node)
        if not known[node] or sent is None:
            continue
        sender = subsystems[sent[0]]
        output = buffer_names(sender.outputs)[sent[1]]
        for states, edges in _grouped_states(known[node]):
            arguments = [literal(sender.qualified_name), literal(output), literal(states)]
            arguments += _input_arguments(sender, edges, computed=not ages.is_measured(node))
            found.append(
                (sender.qualified_name, output, call(imports.runtime_name("Behind"), arguments))
            )
    yield from (text for _, _, text in sorted(found))


def _grouped_states(
    by_state: dict[str, list[ReadEdge]],
) -> Iterator[tuple[tuple[str, ...], list[ReadEdge]]]:
    """The states with what is read there, those that read the same together."""
    groups = grouped((tuple(edges), state) for state, edges in by_state.items())
    return ((tuple(states), list(edges)) for edges, states in groups.items() if edges)


def _input_arguments(sender: Subsystem, edges: list[ReadEdge], *, computed: bool) -> Iterator[str]:
    names = buffer_names(sender.inputs)
    not_fresh = tuple(names[node.peer, node.element] for node, fresh in edges if not fresh)
    fresh = tuple(names[node.peer, node.element] for node, fresh in edges if fresh)
    return keyword_arguments({"held": not_fresh, "fresh": fresh, "computed": computed})
