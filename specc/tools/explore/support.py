"""Contracts of devices that prove a requirement, those that do not count, and those missing."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

from specc.analysis import Facts
from specc.diagnostics.phrases import join_words
from specc.lang.show import show
from specc.model import expr as m
from specc.model.requirement import Reading, Requirement
from specc.model.system import Device
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.cone import Cone, ConeEnding, ConeRow
from specc.tools.explore.contracts import readers
from specc.tools.explore.graph import Graph
from specc.tools.explore.partial import residual
from specc.tools.explore.trace import ExploredTrace
from specc.tools.explore.verdicts import JudgedRequirement, RequirementSlice, is_monitorable


def with_contracts(
    judgement: JudgedRequirement, subject: RequirementSlice, budget: int
) -> JudgedRequirement:
    """A judgement, with a proof for the runs that keep contracts of devices if there is no other.

    The contracts are as few as suffice. One does not count if no device can keep it, or if the
    requirement follows whatever the control subsystem of its agent does.
    """
    verdict, facts = judgement.verdict, subject.abstraction.facts
    if verdict.verdict in ("proved", "violated"):
        return judgement
    contracts, refusal = [*_contracts_about(subject)], ""
    waits = list[tuple[m.Expr, str]]()
    if verdict.verdict == "open" and verdict.finding:
        waits = [*_waits(verdict.finding.trace)]
    awaited = _awaited_devices(waits, subject.abstraction) if contracts else set()
    while contracts:
        # Those of other devices make the search larger, and are rarely needed.
        first = [each for each in contracts if each.device in awaited]
        tried = [first, contracts] if 0 < len(first) < len(contracts) else [contracts]
        found = (_smallest_proof(subject.requirement, some, facts, budget) for some in tried)
        proof = next(filter(None, found), None)
        if proof is None:
            break
        used, graph = proof
        reason = _refusal(subject.requirement, used, graph, facts, budget)
        if not reason:
            proved = replace(
                verdict,
                verdict="proved",
                finding=None,
                why="",
                is_incomplete=False,
                is_dead_end=False,
                given=tuple(each.name for each in used),
            )
            return JudgedRequirement(proved, (), (*judgement.graphs, graph))
        refusal = refusal or reason
        contracts = [each for each in contracts if each not in used]
    missing = _missing_contracts(waits, subject.abstraction)
    return replace(judgement, verdict=replace(verdict, refusal=refusal, missing=missing))


def _contracts_about(subject: RequirementSlice) -> Iterator[Requirement]:
    """The contracts about what the requirement reads, or what machines read that influence it."""
    read = {(x.subsystem, x.element) for x in subject.requirement.readings}
    for contract in subject.abstraction.facts.system.contracts:
        measured = [x for x in contract.readings if x.kind == "reported"]
        found = (reader for x in measured for reader, *_ in readers(x, subject.abstraction))
        if is_monitorable(contract) and (
            any((x.subsystem, x.element) in read for x in measured)
            or any(reader in subject.names for reader in found)
        ):
            yield contract


def _smallest_proof(
    requirement: Requirement, contracts: Sequence[Requirement], facts: Facts, budget: int
) -> tuple[Sequence[Requirement], Graph] | None:
    """Contracts of which each is needed for the proof, and the graph that proves it."""

    def proof(some: Sequence[Requirement]) -> Graph | None:
        return _proof(requirement, some, Abstraction(facts, [requirement, *some]), budget)

    graph = proof(contracts)
    if graph is None:
        return None
    for each in list(contracts):
        fewer = [other for other in contracts if other is not each]
        if fewer and (smaller := proof(fewer)) is not None:
            contracts, graph = fewer, smaller
    return contracts, graph


def _refusal(
    requirement: Requirement,
    contracts: Sequence[Requirement],
    proof: Graph,
    facts: Facts,
    budget: int,
) -> str:
    """Why contracts that prove a requirement do not count; empty if they do."""
    named = join_words([f"`{each.name}`" for each in contracts], "and")
    head = f"the contract {named} does not count"
    if len(contracts) > 1:
        head = f"the contracts {named} do not count"
    if proof.composition.has_dead_end:
        return f"{head}: no device can keep {'them' if len(contracts) > 1 else 'it'}"
    agents = {each.device.partition(".")[0] for each in contracts}
    arbitrary = ArbitraryControl(facts, [requirement, *contracts], agents)
    if _proof(requirement, contracts, arbitrary, budget) is not None:
        return f"{head}: the requirement follows from it whatever the control subsystem does"
    return ""


def _proof(
    requirement: Requirement,
    contracts: Sequence[Requirement],
    abstraction: Abstraction,
    budget: int,
) -> Graph | None:
    """The graph that proves a requirement for all runs that keep the contracts, if one does."""
    subsystems = {x.subsystem for x in requirement.readings if x.kind != "reported"}
    subsystems |= {x.subsystem for each in contracts for x in each.readings}
    names = abstraction.with_influences(subsystems)

    # The time that a contract leaves is counted, and the commands that it is about are followed.
    precision = Precision(counts_time=True, max_values=None)
    composition = Composition(
        names, abstraction, precision, requirements=[requirement], contracts=contracts
    )
    graph = Graph(composition, budget, until=_is_refuted)
    if graph.broken_off:
        raise MemoryError if graph.broken_off == "out of memory" else KeyboardInterrupt
    return graph if graph.is_complete and not _is_refuted(composition) else None


def _is_refuted(composition: Composition) -> bool:
    """Whether some trace, as far as they were explored, does not meet the only requirement."""
    return composition.tracker is None or not composition.tracker.proves(0)


# What contracts do not count for, and which ones are missing.


class ArbitraryControl(Abstraction):
    """An abstraction in which the control subsystems of some agents do anything.

    Each goes from any state to any other in any period; what a state sends has unknown values.
    """

    def __init__(
        self, facts: Facts, requirements: Iterable[Requirement], agents: Collection[str]
    ) -> None:
        super().__init__(facts, requirements)
        self._arbitrary = {f"{agent}.c" for agent in agents}

    def cone(self, name: str) -> Cone:
        """See `Abstraction`."""
        if name not in self._cones and name in self._arbitrary:
            self._cones[name] = _arbitrary(super().cone(name))
        return super().cone(name)


def _arbitrary(cone: Cone) -> Cone:
    """A cone with the same states and outputs, of which nothing else is known."""
    rows = tuple(
        ConeRow(number, state.name, "", _free(f"to {number}", m.TRUE))
        for number, state in enumerate(cone.states)
    )
    ending = ConeEnding("", _free("ends", m.TRUE), rows)
    states = tuple(
        replace(
            state,
            endings=(ending,),
            assignments=tuple((k, _free(".".join(k), v)) for k, v in state.assignments),
            failing=(),
        )
        for state in cone.states
    )
    return replace(cone, states=states, axioms=())


def _free(name: str, like: m.Expr) -> m.Expr:
    """A value of the type of another one of which nothing is known."""
    return m.Input("", name, type=like.type)


def _waits(trace: ExploredTrace) -> Iterator[tuple[m.Expr, str]]:
    """The conditions on which a trace rests, each with its machine."""
    steps = {
        (each.walker.name, each.transition.source, each.transition.choices): each
        for each in reversed(trace.steps)
    }
    for step in reversed(steps.values()):  # each kind of step once, in the order of the trace
        walker = step.walker
        state = walker.cone.state.get(step.transition.source)
        for end in state.endings if state else ():
            names = [(end.condition, end.when), *((r.condition, r.when) for r in end.rows)]
            for name, when in names:
                if f"`{name}`" in step.transition.choices:
                    yield residual(when, walker.static_values), walker.name


def _awaited_devices(waits: Iterable[tuple[m.Expr, str]], abstraction: Abstraction) -> set[str]:
    """The devices that report what these conditions are about."""
    found = set[str]()
    for condition, machine in waits:
        read = {node.key for node in m.walk(condition) if isinstance(node, m.Input)}
        for device in abstraction.facts.system.devices:
            if not read.isdisjoint(dict(_seen_of(device, machine, abstraction))):
                found.add(device.qualified_name)
    return found


def _missing_contracts(
    waits: Iterable[tuple[m.Expr, str]], abstraction: Abstraction
) -> tuple[str, ...]:
    """The shapes of contracts that would decide conditions on measurements."""
    devices = {each.qualified_name: each for each in abstraction.facts.system.devices}
    shapes = (shape for each in waits for shape in _shapes(*each, devices, abstraction))
    return tuple(dict.fromkeys(shapes))[:MOST_SHAPES]


MOST_SHAPES = 2


def _shapes(
    condition: m.Expr, machine: str, devices: Mapping[str, Device], abstraction: Abstraction
) -> Iterator[str]:
    """The contract of one device that says that a condition comes true, if there is one."""
    nodes = {node.key: node for node in m.walk(condition) if isinstance(node, m.Input)}
    others = (m.MemoryRef, m.Clock, m.Call)
    if not nodes or any(isinstance(node, others) for node in m.walk(condition)):
        return
    for device in devices.values():
        names = dict(_seen_of(device, machine, abstraction))
        if device.x and nodes.keys() <= names.keys():
            letter = "E" if device.kind == "real_effector" else "R"
            inputs = {
                node: m.MemoryRef(f"x.{letter}.{device.name}.{names[key]}", type=node.type)
                for key, node in nodes.items()
            }
            text = show(_replaced(condition, inputs))
            command = f"y.{letter}.{device.name}.{device.x[0].name}"
            yield f"`always(stays({command}, T) implies {text})` of `{device.qualified_name}`"


def _seen_of(
    device: Device, machine: str, abstraction: Abstraction
) -> Iterator[tuple[tuple[str, str], str]]:
    """The inputs of a machine that are what a device reports, with its elements."""
    wires = abstraction.facts.wires
    for item in device.y:
        for wire in wires.wires_of_element(device.qualified_name, "x", item.name):
            of = wire.subsystem.qualified_name, (wire.port.peer, item.name)
            reading = Reading(item.name, "reported", *of, item.type, item.place)
            for name, _, node in readers(reading, abstraction):
                if name == machine:
                    yield node.key, item.name


def _replaced(expr: m.Expr, others: Mapping[m.Input, m.Expr]) -> m.Expr:
    if isinstance(expr, m.Input):
        return others.get(expr, expr)
    return m.map_children(expr, lambda part: _replaced(part, others))
