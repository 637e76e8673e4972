"""Explores a whole system, slice by slice; the result has findings, verdicts and coverage."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Literal

from specc.analysis import Facts
from specc.diagnostics.phrases import counted, join_words
from specc.limits import one_run
from specc.model.fsm import Axiom
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.blame import SizeFactor, size_factors
from specc.tools.explore.composition import Composition
from specc.tools.explore.findings import FindingsById, TracedFinding, add_best, findings
from specc.tools.explore.graph import BrokenOff, Graph, broken_off
from specc.tools.explore.plain_graphs import SliceGraphs, TickFormulas, judge_responses
from specc.tools.explore.refine import finest_complete, not_refuted, refine
from specc.tools.explore.support import with_contracts
from specc.tools.explore.symmetry import group_equal_slices
from specc.tools.explore.verdicts import (
    JudgedRequirement,
    RequirementSlice,
    RequirementVerdict,
    judge,
    requirement_slices,
    undecided_verdict,
)

RESPONSE_SHARE, MONITOR_SHARE = 2, 4
"""Each pass for a requirement has one part in so many of the budget, without and with a monitor.

However many there are: so the verdict on one does not depend on the others.
"""
MAX_NAMED = 4
"""Machines and conditions that are named."""
BOUND = "ended at the bound"
AssumptionVerdict = Literal["proved", "refuted", "may fail", "on your word", "not explored"]


@dataclass(frozen=True, slots=True)
class SliceResult:
    """One slice: the part that was explored, and whether time was counted in periods."""

    names: tuple[str, ...]
    configurations: int
    steps: int
    depth_s: float
    complete: bool
    counts_time: bool
    is_timed: bool
    """Whether a condition depends on the time in a state."""
    broken_off: BrokenOff
    widened: tuple[str, ...] = ()
    undecided: int = 0
    """Findings that are neither confirmed nor refuted."""
    undecided_conditions: tuple[tuple[str, str, tuple[str, ...]], ...] = ()
    """Machine, state, and conditions there of which it is unknown whether they ever come true."""
    equal_machines: tuple[str, ...] = ()
    """Machines of equal slices that were not explored themselves."""

    size_factors: tuple[SizeFactor, ...] = ()
    """The values that make it large, if it ended at the bound."""

    @property
    def status(self) -> str:
        """Whether the findings are all there are: complete, bound, or broken off."""
        if not self.complete:
            return self.broken_off or BOUND
        but = f" but for {counted(self.undecided, 'finding')} not decided"
        return f"complete{but if self.undecided else ''}"

    def summary(self) -> str:
        """A line on the coverage of the slice and its abstraction."""
        what = f"{', '.join(self.names)}: "
        states = counted(self.configurations, "state")
        if self.complete:
            what += f"explored {self.status.replace('complete', 'completely', 1)}: {states}"
        else:
            what += f"{self.status} after {states}, {self.depth_s:g} s into the runs"
        if self.is_timed:
            what += f"; times counted {'in periods' if self.counts_time else 'roughly'}"
        if self.equal_machines:
            shown = (*self.equal_machines[:MAX_NAMED], "...")[: len(self.equal_machines)]
            what += f"; so for {', '.join(shown)}"
        if self.widened:
            what += f"; not all values followed of: {', '.join(self.widened)}"
        conditions = dict.fromkeys(
            name for _, _, names in self.undecided_conditions for name in names
        )
        if conditions:
            named = [*conditions][:MAX_NAMED]
            if len(conditions) > len(named):
                named.append(f"{len(conditions) - len(named)} more")
            comes = "comes" if len(named) == 1 else "come"
            what += f"; not judged is whether {join_words(named, 'and')} ever {comes} true"
        return what


@dataclass(eq=False, slots=True)
class Exploration:
    """The result: slices, findings, and verdicts on assumptions and requirements."""

    slices: list[SliceResult] = field(default_factory=list)
    findings: list[TracedFinding] = field(default_factory=list)
    assumptions: list[tuple[str, Axiom, AssumptionVerdict]] = field(default_factory=list)
    requirements: list[RequirementVerdict] = field(default_factory=list)
    without_decisions: tuple[str, ...] = ()
    """Machines that decide nothing."""
    not_begun: list[tuple[str, ...]] = field(default_factory=list)
    """Slices that were not begun because exploring was broken off."""
    broken_off: BrokenOff = ""
    forgotten_memory: tuple[str, ...] = ()
    """Memory of which nothing was known, as the user wished."""
    reached_rows: set[tuple[str, int]] = field(default_factory=set)
    """The rows that some way takes, by machine and index in its table."""

    @property
    def status(self) -> str:
        """The word for the whole: complete, complete but for findings, bound, broken off."""
        if self.broken_off:
            return self.broken_off
        if self.is_incomplete:
            return BOUND
        undecided = sum(not finding.is_confirmed for finding in self.findings)
        but = f" but for {counted(undecided, 'finding')} not decided"
        return f"complete{but if undecided else ''}"

    @property
    def dead_ends(self) -> str:
        """How many requirements measurements can break, as words; nothing for none."""
        count = sum(each.is_dead_end for each in self.requirements)
        return f"{counted(count, 'requirement')} can be broken by what is measured" if count else ""

    @property
    def with_traces(self) -> list[TracedFinding]:
        """The findings, then the violations that rest on conditions and are none."""
        rest = (each.finding for each in self.requirements if each.verdict == "open")
        return [*self.findings, *filter(None, rest)]

    @property
    def is_incomplete(self) -> bool:
        """Whether more steps would explore more."""
        unfinished = any(r.is_incomplete or r.verdict == "not explored" for r in self.requirements)
        complete = all(each.complete for each in self.slices)
        return not self.broken_off and (unfinished or not complete)


def explore(facts: Facts, budget: int, forgotten_memory: Collection[str] = ()) -> Exploration:
    """Explore a system without errors, its groups in `budget` steps of single machines.

    Each requirement has a share of as many for itself. Nothing is known of `forgotten_memory`,
    with names such as `irp.m.tries`. Ctrl-C ends it, with the findings until then.
    """
    with one_run():
        return _explore(facts, budget, forgotten_memory)


def _explore(facts: Facts, budget: int, forgotten_memory: Collection[str]) -> Exploration:
    abstraction = Abstraction(facts, (), forgotten_memory)
    result = Exploration(forgotten_memory=tuple(forgotten_memory))
    graphs = list[SliceGraphs]()
    found: FindingsById = {}
    verdicts: dict[tuple[str, int], set[AssumptionVerdict]] = {}
    slices, required = (
        group_equal_slices(abstraction.slices(), abstraction),
        requirement_slices(facts, forgotten_memory),
    )
    for index, (names, others) in enumerate(slices):
        if result.broken_off:
            result.not_begun.append(names)
            continue
        spent = sum(each.steps for each in result.slices)
        share = max(0, budget - spent) // (len(slices) - index)
        explored, graph, found_here, all_graphs = _explore_slice(names, abstraction, facts, share)
        graphs.append(SliceGraphs(all_graphs, abstraction, share // MONITOR_SHARE))
        for finding in found_here.values():
            add_best(found, finding)
        for name, row in _reached_rows(graph):
            result.reached_rows.update((same[name], row) for same in ({name: name}, *others))
        alike = tuple(new for same in others for old, new in same.items() if new != old)
        result.slices.append(replace(explored, equal_machines=alike))
        result.broken_off = graph.broken_off
        for walker in graph.composition.walkers:
            for number in range(len(walker.subsystem.axioms)):
                answers = walker.assumption_truths.get(number, set())
                failing = found_here.get(("W1006", walker.kind, number))
                verdict = _verdict(answers, failing, complete=graph.is_complete)
                for same in (walker.name, *(each[walker.name] for each in others)):
                    verdicts.setdefault((same, number), set()).add(verdict)
    result.findings = [f for f in found.values() if not _is_proved(f, verdicts)]
    result.assumptions = [
        (name, machine.subsystem.axioms[index], _combined_verdict(answers))
        for (name, index), answers in sorted(verdicts.items())
        for machine in (abstraction.machines[name],)
    ]
    groups = [*(each.names for each in result.slices), *result.not_begun]
    groups += [each.equal_machines for each in result.slices]
    inside = {name for names in groups for name in names}
    _explore_requirements(result, required, graphs, facts, budget)
    result.without_decisions = tuple(name for name in abstraction.machines if name not in inside)
    return result


def _explore_requirements(
    result: Exploration,
    required: Sequence[RequirementSlice],
    graphs: Sequence[SliceGraphs],
    facts: Facts,
    budget: int,
) -> None:
    """Prove the requirements on the graphs of slices, and explore the others, each alone."""
    verdicts: dict[int, RequirementVerdict] = {}
    for subject in required:
        key = id(subject.requirement)
        verdicts[key] = RequirementVerdict(subject.requirement, "not explored")
        if result.broken_off:
            continue
        try:
            proofs = (each.proof(subject.requirement) for each in graphs)
            if proof := next(filter(None, proofs), None):
                verdicts[key] = proof
                continue
            judgement = _judge(subject, budget)
        except (KeyboardInterrupt, MemoryError) as error:
            result.broken_off = broken_off(error)
            continue
        graphs_here = judgement.graphs
        result.broken_off = next((g.broken_off for g in graphs_here if g.broken_off), "")
        verdicts[key] = judgement.verdict
        result.findings += judgement.findings
    result.requirements = [
        verdicts.get(id(requirement)) or undecided_verdict(requirement)
        for requirement in facts.system.requirements
    ]


def _judge(subject: RequirementSlice, budget: int) -> JudgedRequirement:
    """Judge a requirement without a monitor if its shape allows that, then given contracts."""
    formulas = TickFormulas.of(subject.requirement)
    found = judge_responses(subject, formulas, budget // RESPONSE_SHARE) if formulas else None
    share = budget // MONITOR_SHARE
    return with_contracts(found or judge(subject, share), subject, share)


def _explore_slice(
    names: tuple[str, ...], abstraction: Abstraction, facts: Facts, budget: int
) -> tuple[SliceResult, Graph, FindingsById, list[Graph]]:
    """Explore a slice: its summary, its most exact complete graph, the findings, and all graphs."""
    steps = refine(
        lambda precision, most: Graph(Composition(names, abstraction, precision), most),
        lambda graph: _findings_or_none(graph, abstraction, facts),
        budget,
    )
    graph = finest_complete(each for each, _ in steps)
    found = {
        about: replace(finding, is_confirmed=exactly or finding.trace.is_decided)
        for about, (finding, exactly) in not_refuted(steps).items()
    }
    return (
        _summary(graph, sum(not each.is_confirmed for each in found.values())),
        graph,
        found,
        [g for g, _ in steps],
    )


def _reached_rows(graph: Graph) -> set[tuple[str, int]]:
    """The rows that some way takes, by machine and index; what a copy takes all of them can."""
    names, found = graph.composition.names, set[tuple[int, int]]()
    for edge in chain.from_iterable(graph.edges):
        found.update((machine, move.row) for machine, move in edge.transitions if move.row >= 0)
    alike = {
        machine: same
        for copies in graph.composition.copies
        for same in zip(*copies.machines, strict=True)
        for machine in same
    }
    return {(names[n], row) for machine, row in found for n in alike.get(machine, (machine,))}


def _findings_or_none(graph: Graph, abstraction: Abstraction, facts: Facts) -> FindingsById:
    """The findings in a graph; none if the search is broken off."""
    try:
        return findings(graph, abstraction, facts.system)
    except (KeyboardInterrupt, MemoryError) as error:
        graph.broken_off = broken_off(error)
    return {}


def _summary(graph: Graph, undecided: int) -> SliceResult:
    composition = graph.composition
    return SliceResult(
        composition.names,
        len(graph.configurations),
        graph.steps,
        0.0 if graph.is_complete else float(graph.depth_s(len(graph.edges))),
        graph.is_complete,
        composition.precision.counts_time,
        composition.is_timed,
        graph.broken_off,
        tuple(sorted(composition.widened)),
        undecided,
        tuple(
            (walker.name, state, tuple(names))
            for walker in composition.walkers
            for state, names in walker.open_conditions.items()
        ),
        (),
        () if graph.is_complete or graph.broken_off else size_factors(graph),
    )


def _verdict(
    answers: set[bool | None], failing: TracedFinding | None, *, complete: bool
) -> AssumptionVerdict:
    if False in answers or failing:
        return "refuted" if failing and failing.trace.is_decided else "may fail"
    if not complete:
        return "not explored"
    return "on your word" if None in answers else "proved"


_VERDICT_ORDER: tuple[AssumptionVerdict, ...] = (
    "proved",
    "refuted",
    "on your word",
    "may fail",
    "not explored",
)


def _combined_verdict(verdicts: set[AssumptionVerdict]) -> AssumptionVerdict:
    return min(verdicts, key=_VERDICT_ORDER.index)


def _is_proved(
    finding: TracedFinding, verdicts: dict[tuple[str, int], set[AssumptionVerdict]]
) -> bool:
    """Whether another slice proves the assumption that this finding says fails."""
    if finding.code != "W1006":
        return False
    _, name, index = finding.identity
    return _combined_verdict(verdicts[name, index]) == "proved"  # type: ignore[index]  # what W1006 is about
