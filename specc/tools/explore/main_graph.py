"""Proofs on the graph of a slice, which was explored without any requirement.

A requirement about single ticks holds if it holds in each configuration. A bounded response holds
if no run stays unanswered for longer than its deadline. Both need no monitor, so all requirements
share one graph, and none changes what another one finds. What is not proved here is explored again
with a monitor (`specc.tools.explore.verdicts`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property

from specc.model import requirement as r
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.graph import Graph
from specc.tools.explore.monitor import TruthValue
from specc.tools.explore.ranking import longest_stays
from specc.tools.explore.response import responses
from specc.tools.explore.tracker import RequirementTracker
from specc.tools.explore.verdicts import RequirementVerdict, trigger_of


class SliceGraphs:
    """The complete graphs of a slice: those on which findings were looked for, and one that counts.

    A deadline needs time to be counted even if no finding does.
    """

    def __init__(self, graphs: Sequence[Graph], abstraction: Abstraction, budget: int) -> None:
        """`budget` is that of the graph that counts time."""
        self._found = [graph for graph in graphs if graph.is_complete]
        self._tried = graphs
        self._abstraction, self._budget = abstraction, budget

    @cached_property
    def _counted(self) -> list[Graph]:
        if any(g.is_counted for g in self._found):
            return []
        names = self._tried[0].composition.names
        precision = Precision(counts_time=True)
        return [Graph(Composition(names, self._abstraction, precision), self._budget)]

    def proof(self, requirement: r.Requirement) -> RequirementVerdict | None:
        """The verdict on a requirement that some graph proves."""
        if not all(x.subsystem in self._tried[0].composition.names for x in requirement.readings):
            return None
        for graph in self._found:
            if proof := proof_on(graph, requirement, self._abstraction):
                return proof
        if r.is_timeless(requirement.formula) or None in responses(requirement.formula):
            return None
        found = (proof_on(graph, requirement, self._abstraction) for graph in self._counted)
        return next(filter(None, found), None)


def proof_on(
    graph: Graph, requirement: r.Requirement, abstraction: Abstraction
) -> RequirementVerdict | None:
    """The verdict on a requirement that a graph proves."""
    parts = list(responses(requirement.formula))
    if None in parts or not graph.is_complete:
        return None
    formulas = [f for part in parts if part for f in (part.antecedent, part.answer)]
    trigger = trigger_of(requirement)
    formulas += [trigger] if trigger else []
    each = [replace(requirement, formula=formula, holds_always=True) for formula in formulas]
    truths = _truths(graph, each, abstraction)
    if truths is None:
        return None
    for number, part in enumerate(filter(None, parts)):
        requested, answered = truths[2 * number : 2 * number + 2]
        begins = range(len(requested)) if requirement.holds_always else (0,)
        pending = [n for n in begins if requested[n] is not False and answered[n] is not True]
        deadline = part.deadline_s / graph.composition.tick_s
        if pending and (not deadline or not _is_answered(graph, pending, answered, deadline)):
            return None
    is_triggered = not trigger or any(truth is not False for truth in truths[-1])
    return RequirementVerdict(requirement, "proved", is_triggered=is_triggered)


def _is_answered(
    graph: Graph, pending: Sequence[int], answered: Sequence[TruthValue], deadline: Fraction
) -> bool:
    """Whether an answer comes within the deadline after the pending configurations."""
    stays = longest_stays(
        pending,
        lambda n: [
            (edge.target, edge.transitions)
            for edge in graph.edges[n]
            if answered[edge.target] is not True
        ],
        graph.elapsed_ticks,
        graph.region,
    )
    return all(n in stays and stays[n] <= deadline for n in pending)


def _truths(
    graph: Graph, formulas: Sequence[r.Requirement], abstraction: Abstraction
) -> list[list[TruthValue]] | None:
    """Whether each formula about single ticks holds, by configuration.

    None if the graph does not show a value that a formula reads.
    """
    composition = graph.composition
    system, tick_s = abstraction.facts.system, abstraction.tick_s
    tracker = RequirementTracker(
        formulas, (), composition.walkers, composition.values, system, tick_s
    )
    slots = [_buffer_of(composition, reading) for reading in tracker.sent_readings]
    copied = {i for copies in composition.copies for copy in copies.machines for i in copy}
    machines = {composition.names.index(x.subsystem) for f in formulas for x in f.readings}
    if None in slots or (copied and (slots or not copied.isdisjoint(machines))):
        return None
    found: list[list[TruthValue]] = [[] for _ in formulas]
    for configuration in graph.configurations:
        parts = composition.parts_of(configuration)
        seen = [parts[reader].buffers[slot] // 2 for reader, slot in filter(None, slots)]
        states = composition.machine_states(configuration)
        for truths, truth in zip(found, tracker.truths_now(seen, states), strict=True):
            truths.append(truth)
    return found


def _buffer_of(composition: Composition, reading: r.Reading) -> tuple[int, int] | None:
    """The machine and the slot of the buffer that shows a sent value from the start."""
    sender = composition.names.index(reading.subsystem)
    peer, name = reading.element
    found = composition.receiver(sender, (peer, name))
    if found is None:
        return None
    walker = composition.walkers[found[0]]
    key = walker.inputs[found[1]]
    shows_init = walker.subsystem.inputs[key].init is not None
    return found if shows_init == (reading.initial == (walker.name, *key)) else None
