"""Requirements judged on graphs without deadlines in them.

A requirement about single ticks holds if it holds in each configuration. A bounded response holds
if no run stays unanswered for longer than its deadline. Neither needs a monitor that counts down,
which would make a graph as many times larger as a deadline has ticks. The graphs of the slices
prove what they can: all requirements share them, and none changes what another one finds. For the
others there are graphs that also follow what the requirement reads.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

from specc.model import requirement as r
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Edge, Precision
from specc.tools.explore.findings import TracedFinding
from specc.tools.explore.graph import Cost, Graph, extended_cost
from specc.tools.explore.monitor import TruthValue
from specc.tools.explore.ranking import longest_stays
from specc.tools.explore.refine import not_refuted, refine
from specc.tools.explore.response import PendingAnswers, Response, responses
from specc.tools.explore.trace import easiest_trace
from specc.tools.explore.tracker import RequirementTracker
from specc.tools.explore.verdicts import (
    JudgedRequirement,
    RequirementSlice,
    RequirementVerdict,
    trigger_of,
    verdict_of,
    violation_finding,
)


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
        composition = Composition(names, self._abstraction, precision)
        return [Graph(composition, self._budget)]

    def proof(self, requirement: r.Requirement) -> RequirementVerdict | None:
        """The verdict on a requirement that some graph proves."""
        formulas = TickFormulas.of(requirement)
        names = self._tried[0].composition.names
        if formulas is None or not all(x.subsystem in names for x in requirement.readings):
            return None
        for graph in self._found:
            if proof := self._proof_on(graph, formulas):
                return proof
        if r.is_timeless(requirement.formula):
            return None
        found = (self._proof_on(graph, formulas) for graph in self._counted)
        return next(filter(None, found), None)

    def _proof_on(self, graph: Graph, formulas: TickFormulas) -> RequirementVerdict | None:
        if not graph.is_complete or graph.may_fail:  # a step that fails ends a stay, too
            return None
        truths = _truths(graph, formulas.each, self._abstraction)
        if truths is None:
            return None
        judged = JudgedGraph(graph, formulas, truths)
        if not judged.is_proved:
            return None
        return RequirementVerdict(formulas.requirement, "proved", is_triggered=judged.is_triggered)


@dataclass(frozen=True, slots=True)
class TickFormulas:
    """The formulas about single ticks in a requirement that consists of responses.

    `each` has the request and the answer of each response, then what asks the requirement, if that
    is known.
    """

    requirement: r.Requirement
    responses: tuple[Response, ...]
    each: tuple[r.Requirement, ...]

    @classmethod
    def of(cls, requirement: r.Requirement) -> TickFormulas | None:
        """Those of a requirement; None if it has another shape."""
        parts = tuple(responses(requirement.formula))
        known = tuple(filter(None, parts))
        if len(known) < len(parts):
            return None
        trigger = trigger_of(requirement)
        formulas = [f for part in known for f in (part.antecedent, part.answer)]
        formulas += [trigger] if trigger else []
        each = (replace(requirement, formula=f, holds_always=True) for f in formulas)
        return cls(requirement, known, tuple(each))


class JudgedGraph:
    """A graph with the truth of formulas about single ticks in each configuration."""

    def __init__(
        self, graph: Graph, formulas: TickFormulas, truths: Sequence[Sequence[TruthValue]]
    ) -> None:
        self.graph, self._requirement = graph, formulas.requirement
        tick_s = graph.composition.tick_s
        self._responses = formulas.responses
        self._parts = [
            (truths[2 * n], truths[2 * n + 1], part.deadline_s / tick_s)
            for n, part in enumerate(formulas.responses)
        ]
        triggers = truths[2 * len(self._parts) :]
        self.is_triggered = not triggers or any(truth is not False for truth in triggers[0])
        """Whether some run may ask the requirement."""
        self._begins = range(len(graph.configurations) if self._requirement.holds_always else 1)
        """The configurations in which it may be asked."""

    @cached_property
    def is_proved(self) -> bool:
        """Whether each answer surely comes in time."""
        return self.graph.is_complete and all(
            self._is_answered(requested, answered, deadline)
            for requested, answered, deadline in self._parts
        )

    def _is_answered(
        self, requested: Sequence[TruthValue], answered: Sequence[TruthValue], deadline: Fraction
    ) -> bool:
        unanswered = [truth is not True for truth in answered]
        pending = [n for n in self._begins if requested[n] is not False and unanswered[n]]
        stays = self._stays(pending, unanswered, ranked=True) if deadline and pending else {}
        return all(n in stays and stays[n] <= deadline for n in pending)

    def _stays(
        self, pending: Sequence[int], unanswered: Sequence[bool], *, ranked: bool
    ) -> dict[int, int]:
        """For how many ticks an answer may be pending; without where it may be for ever.

        If it is `ranked`, counters end cycles.
        """
        return longest_stays(
            pending,
            lambda number: [
                (edge.target, edge.transitions)
                for edge in self._edges(number)
                if unanswered[edge.target]
            ],
            self.graph.elapsed_ticks,
            self.graph.region if ranked else None,
        )

    def _edges(self, number: int) -> Sequence[Edge]:
        return self.graph.edges[number] if number < len(self.graph.edges) else ()

    def violation(self) -> TracedFinding | None:
        """The finding on an answer that surely does not come in time on some trace."""
        for requested, answered, deadline in self._parts:
            missing = [truth is False for truth in answered]
            pending = [n for n in self._begins if requested[n] is True and missing[n]]
            stays = self._stays(pending, missing, ranked=False) if deadline else {}
            late = [n for n in pending if stays.get(n, deadline + 1) > deadline or not deadline]
            if late:
                start = min(late, key=lambda n: (self.graph.cost(n), n))
                trace = easiest_trace(
                    self.graph, start, *self._late_path(start, missing, stays, deadline)
                )
                return violation_finding(self._requirement, trace)
        return None

    def _late_path(
        self, here: int, missing: Sequence[bool], stays: Mapping[int, int], deadline: Fraction
    ) -> list[Edge]:
        """An easy path on which the answer is missing for longer than the deadline."""
        path = list[Edge]()
        passed = self.graph.elapsed_ticks(here)
        while passed <= deadline and here < len(self.graph.edges):
            following = (
                edge
                for edge in self.graph.edges[here]
                if missing[edge.target] and passed + stays.get(edge.target, deadline + 1) > deadline
            )
            path.append(min(following, key=lambda edge: (extended_cost(_FREE, edge), edge.target)))
            here = path[-1].target
            passed += self.graph.elapsed_ticks(here)
        return path

    def dead_end(self) -> TracedFinding | None:
        """The finding on an answer that cannot come any more, unless it is requested anew."""
        for (requested, answered, _), part in zip(self._parts, self._responses, strict=True):
            starts = [n for n in self._begins if requested[n] is True and answered[n] is False]
            if not part.deadline_s:
                continue
            if not self._requirement.holds_always:  # nothing is asked after the start
                requested = [False] * len(requested)
            end = PendingAnswers(self.graph, requested, answered, part.deadline_s).dead_end(starts)
            if end is not None:
                trace = easiest_trace(self.graph, end.start, *end.path)
                return violation_finding(self._requirement, trace, can_retry=end.can_retry)
        return None


_FREE: Cost = 0, 0, 0, 0


def judge_responses(
    subject: RequirementSlice, formulas: TickFormulas, budget: int
) -> JudgedRequirement | None:
    """The judgement of a requirement that consists of responses, on graphs that follow its values.

    None if steps may fail, which only a monitor can judge.
    """
    requirement = subject.requirement
    judged: dict[int, JudgedGraph] = {}

    def build(precision: Precision, budget: int, *, only_forced: bool = False) -> Graph:
        composition = Composition(
            subject.names,
            subject.abstraction,
            precision,
            probes=formulas.each,
            only_forced=only_forced,
        )
        graph = Graph(composition, budget)
        judged[id(graph)] = JudgedGraph(graph, formulas, _tracked_truths(graph, formulas))
        return graph

    def look(graph: Graph) -> dict[int, TracedFinding]:
        here = judged[id(graph)]
        # A proof excludes violations, which may go round a cycle that a counter ends.
        found = None if here.is_proved else here.violation()
        return {} if found is None else {0: found}

    results = refine(build, look, budget, lambda graph: judged[id(graph)].is_proved)
    graphs = [graph for graph, _ in results]
    if not (graphs[-1].is_complete or graphs[-1].broken_off):
        # With a deadline too distant for all traces, a single one may still show what is awaited.
        single = build(Precision(counts_time=True), budget, only_forced=True)
        results += [(single, seen)] if (seen := look(single)) else []
    if any(graph.may_fail for graph in graphs):
        return None
    every = [judged[id(graph)] for graph in graphs]
    violation, is_exact = not_refuted(results).get(0, (None, False))
    is_proved = any(each.is_proved for each in every)
    verdict, why = verdict_of(requirement, violation, graphs, is_proved=is_proved)
    # Where any time may pass, an answer that comes in time may seem to come too late.
    counted = [each for each in every if each.graph.is_counted] if verdict == "open" else []
    found = [(each.graph, each.dead_end()) for each in counted]
    ends = not_refuted([(graph, {0: end} if end else {}) for graph, end in found])
    if verdict == "not decided":
        violation = None
    if violation is not None and ends:
        end, is_exact = ends[0]
        # That nothing is asked anew rests on conditions, too.
        choices = end.trace.choices or violation.trace.choices
        violation = replace(end, trace=replace(end.trace, choices=choices))
        verdict = "may be violated"
    return JudgedRequirement.of(
        RequirementVerdict(
            requirement,
            verdict,
            violation,
            why,
            is_triggered=any(each.is_triggered for each in every),
            is_incomplete=verdict == "open" and not any(each.graph.is_complete for each in counted),
            is_dead_end=bool(ends),
        ),
        graphs,
        is_exact=is_exact,
    )


def _tracked_truths(graph: Graph, formulas: TickFormulas) -> list[list[TruthValue]]:
    """The truth of formulas that the graph follows."""
    composition = graph.composition
    tracker = composition.tracker
    assert tracker is not None
    found: list[list[TruthValue]] = [[] for _ in formulas.each]
    for each in graph.configurations:
        seen = tracker.state(each.tracker_state).values
        truths_now = tracker.truths_now(seen, composition.machine_states(each))
        for truths, truth in zip(found, truths_now, strict=True):
            truths.append(truth)
    return found


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
