"""Requirements as goals of exploring: proved, violated on some trace, or not decided.

Each requirement is explored alone, with all machines that influence it. So no other requirement
changes its verdict.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from specc.analysis import Facts
from specc.diagnostics.phrases import join_words
from specc.model.requirement import (
    BoolOp,
    Requirement,
    Temporal,
    TemporalFormula,
    antecedent,
    horizon_s,
    is_timeless,
)
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.findings import TracedFinding
from specc.tools.explore.graph import Graph
from specc.tools.explore.monitor import TruthValue
from specc.tools.explore.refine import Refinement, not_refuted, refine
from specc.tools.explore.response import PendingAnswers, responses
from specc.tools.explore.support import (
    NONE,
    is_monitorable,
    missing_contracts,
    prove_given,
)
from specc.tools.explore.trace import ExploredTrace, easiest_trace
from specc.tools.explore.tracker import RequirementTracker

RequirementStatus = Literal[
    "proved", "violated", "may be violated", "open", "not decided", "not explored"
]

MOST_NAMED = 3
"""Measurements that a verdict names."""


@dataclass(frozen=True, slots=True)
class RequirementVerdict:
    """The verdict on a requirement, and the trace on which it is violated, if there is one."""

    requirement: Requirement
    verdict: RequirementStatus
    finding: TracedFinding | None = None
    why: str = ""
    """The reason of `not decided`, if it lies in the formula and not in the values."""
    is_triggered: bool = True
    """Whether some run may trigger it; if not, it holds vacuously."""
    may_end_early: bool = False
    """Whether a failing step leaves it open on some trace."""
    is_incomplete: bool = False
    """Whether exploring did not find out if the awaited answer can come."""
    is_dead_end: bool = False
    """Whether measurements can lead to a configuration after which no answer can come."""
    given: tuple[str, ...] = ()
    """The contracts of devices without which it is not proved."""
    refusal: str = ""
    """Why contracts that would prove it do not count."""
    missing: tuple[str, ...] = ()
    """Contracts that might prove it, in words."""

    @property
    def assumptions(self) -> tuple[str, ...]:
        """The conditions on which a violation rests."""
        return self.finding.trace.choices if self.finding else ()

    def summary(self) -> str:
        """The verdict."""
        refusal = f"; {self.refusal}" if self.refusal else ""
        if self.verdict == "open":
            missing = f"; a contract of a device that might prove it: {'; '.join(self.missing)}"
            missing = missing if self.missing and not refusal else ""
            return f"rests on {join_words(self.assumptions, 'and')}{refusal}{missing}"
        if self.verdict == "not decided":
            why = self.why or _unknown_values(self.requirement)
            return f"not decided, since {why}{refusal}"
        if self.given:
            contracts = "contract" if len(self.given) == 1 else "contracts"
            names = join_words([f"`{name}`" for name in self.given], "and")
            return f"proved, given the {contracts} {names}"
        if not self.is_triggered:
            return "proved, but never asked"
        if self.may_end_early and self.verdict == "proved":
            return "proved until a step fails"
        if self.verdict == "violated":
            return "violated in every run, unless a step fails by then"
        return self.verdict


def _unknown_values(requirement: Requirement) -> str:
    """The values of a requirement that exploring cannot know."""
    measured = ("reported", "observed")
    found = dict.fromkeys(f"`{x.name}`" for x in requirement.readings if x.kind in measured)
    if not found:
        return "it is about values that are not known"
    named = [*found][:MOST_NAMED]
    if len(found) > len(named):
        named.append(f"{len(found) - len(named)} more")
    return f"{join_words(named, 'and')} {'is' if len(found) == 1 else 'are'} measured"


@dataclass(frozen=True, slots=True)
class RequirementSlice:
    """A requirement that monitors can evaluate, with all machines that influence what it reads."""

    requirement: Requirement
    names: tuple[str, ...]
    abstraction: Abstraction


def requirement_slices(facts: Facts) -> list[RequirementSlice]:
    """The requirements that monitors can evaluate, those about single ticks first."""
    found = []
    under_contract = {x.name for each in facts.system.contracts for x in each.readings}
    for requirement in facts.system.requirements:
        # What is measured is decided by contracts at most.
        subsystems = {
            x.subsystem
            for x in requirement.readings
            if x.kind != "reported" or x.name in under_contract
        }
        abstraction = Abstraction(facts, [requirement])
        names = abstraction.with_influences(subsystems)
        if names and is_monitorable(requirement):
            found.append(RequirementSlice(requirement, names, abstraction))
    return sorted(found, key=lambda each: not is_timeless(each.requirement.formula))


def undecided_verdict(requirement: Requirement) -> RequirementVerdict:
    """The verdict on a requirement that is in no group."""
    if is_monitorable(requirement):
        return RequirementVerdict(requirement, "not decided")
    return RequirementVerdict(requirement, "not decided", why="it looks ahead from the past")


def judge(
    subject: RequirementSlice, budget: int
) -> tuple[RequirementVerdict, list[TracedFinding], list[Graph]]:
    """The verdict on a requirement, its findings, and the graphs."""
    requirement, abstraction = subject.requirement, subject.abstraction
    probe = _probe(requirement)
    probes = () if probe is None else (probe,)

    def build(precision: Precision, budget: int, *, only_forced: bool = False) -> Graph:
        composition = Composition(
            subject.names,
            abstraction,
            precision,
            requirements=[requirement],
            probes=probes,
            only_forced=only_forced,
        )
        return Graph(composition, budget)

    def look(graph: Graph) -> dict[int, TracedFinding]:
        return {index: _violation_finding(graph, requirement) for index in graph.violated}

    results = refine(build, look, budget)
    graphs = [graph for graph, _ in results]
    last = graphs[-1]
    if not (last.is_complete or last.broken_off):
        # With deadlines too distant for all traces, a single trace may still show the awaited one.
        one = build(Precision(counts_time=True), budget, only_forced=True)
        results.insert(0, (one, look(one)))
    violation, is_exact = not_refuted(results).get(0, (None, False))
    verdict = _verdict(graphs, requirement, violation)
    is_asked = not (verdict == "proved" and probes and _is_proved(graphs, 1))
    why = ""
    if verdict == "not decided":
        why, violation = (
            _undecidable_reason(violation) if violation else _absent_values(graphs),
            None,
        )
    ends = _dead_ends(subject, budget // 2) if verdict == "open" else []
    is_dead_end = bool(standing := not_refuted(ends))
    if violation is not None and is_dead_end:
        found, is_exact = standing[0]
        # That nothing is asked anew rests on conditions, too.
        choices = found.trace.choices or violation.trace.choices
        violation, verdict = (
            replace(found, trace=replace(found.trace, choices=choices)),
            "may be violated",
        )
    support = prove_given(requirement, abstraction.facts, budget) if verdict in _OPEN else NONE
    if support.names:
        verdict, violation, is_dead_end, ends = "proved", None, False, []
    missing: tuple[str, ...] = ()
    if violation is not None and verdict == "open":
        missing = missing_contracts(violation.trace, abstraction)
    findings = []
    if violation is not None and verdict != "open":
        findings.append(replace(violation, is_confirmed=is_exact or violation.trace.is_decided))
    result = RequirementVerdict(
        requirement,
        verdict,
        violation,
        why,
        is_triggered=is_asked,
        may_end_early=any(_tracker(graph).ends_early(0) for graph in graphs),
        is_incomplete=bool(ends)
        and not is_dead_end
        and not any(graph.is_complete for graph, _ in ends),
        is_dead_end=is_dead_end,
        given=support.names,
        refusal=support.refusal,
        missing=missing,
    )
    return result, findings, [*(graph for graph, _ in (*results, *ends)), *support.graphs]


_OPEN: Collection[RequirementStatus] = ("may be violated", "open", "not decided", "not explored")


def _dead_ends(subject: RequirementSlice, budget: int) -> Refinement[int, TracedFinding]:
    """Graphs with the finding, as 0, on an answer that cannot come any more, if there is one."""
    requirement, abstraction = subject.requirement, subject.abstraction
    every = list(responses(requirement.formula))
    at_once = [replace(requirement, formula=each.immediate, holds_always=True) for each in every]
    probes = [
        replace(at_once[0], formula=f) for each in every for f in (each.antecedent, each.answer)
    ]

    def build(precision: Precision, budget: int) -> Graph:
        composition = Composition(
            subject.names, abstraction, precision, requirements=at_once, probes=probes
        )
        return Graph(composition, budget)

    def look(graph: Graph) -> dict[int, TracedFinding]:
        for index, response in enumerate(every):
            first = len(at_once) + 2 * index
            requested, answered = (_truths(graph, place) for place in (first, first + 1))
            begins = range(len(requested)) if requirement.holds_always else (0,)
            starts = [n for n in begins if requested[n] is True and answered[n] is False]
            if not requirement.holds_always:  # nothing is asked after the start
                requested = [False] * len(requested)
            end = PendingAnswers(graph, requested, answered, response.deadline_s).dead_end(starts)
            if end is not None:
                path = easiest_trace(graph, end.start, *end.path)
                return {0: _finding(requirement, path, can_retry=end.can_retry)}
        return {}

    return refine(build, look, budget) if every else []


def _truths(graph: Graph, index: int) -> list[TruthValue]:
    """Whether a requirement about single ticks holds in each configuration."""
    tracker, states_of = _tracker(graph), graph.composition.machine_states
    return [tracker.truth(index, c.tracker_state, states_of(c)) for c in graph.configurations]


def _tracker(graph: Graph) -> RequirementTracker:
    assert graph.composition.tracker is not None  # requirements are followed
    return graph.composition.tracker


def _violation_finding(graph: Graph, requirement: Requirement) -> TracedFinding:
    """The finding on a violation, with the easiest trace to it."""
    number, edges = graph.violation(0)
    return _finding(requirement, easiest_trace(graph, number, *edges))


def _finding(
    requirement: Requirement, trace: ExploredTrace, *, can_retry: bool = False
) -> TracedFinding:
    states = {step.walker.name: step.transition.target for step in trace.steps}
    subsystems = dict.fromkeys(x.subsystem for x in requirement.readings)
    where = ", ".join(f"`{name}` in `{states[name]}`" for name in subsystems if name in states)
    what = "can no longer be met" if horizon_s(requirement.formula) else "is violated"
    but = ", unless the request is made again" if can_retry else ""
    return TracedFinding(
        ("W1007", requirement.that, requirement.place),
        "W1007",
        f"this requirement {what} {float(trace.time_s):g} s after the start{but}, with {where}",
        requirement.place,
        f"because: {requirement.because}",
        "change what the machines do on this way, or require less",
        trace,
    )


def _verdict(
    graphs: Sequence[Graph], requirement: Requirement, violation: TracedFinding | None
) -> RequirementStatus:
    if violation is not None:
        if violation.trace.is_decided:
            return "violated"
        # Answers in time rest on plants; the exclusion of a state does not.
        if not horizon_s(requirement.formula):
            return "may be violated"
        return "open" if violation.trace.rests_on_measurements else "not decided"
    if _is_proved(graphs, 0):
        return "proved"
    return "not decided" if any(graph.is_complete for graph in graphs) else "not explored"


def _undecidable_reason(violation: TracedFinding) -> str:
    """Why a violation that rests on conditions does not rest on measurements."""
    choices = join_words(violation.trace.choices, "and")
    return f"its violation rests on {choices}, which nothing measured decides"


def _absent_values(graphs: Sequence[Graph]) -> str:
    """Which values of the requirement are absent, if it would be decided with them."""
    for names in (_tracker(graph).absent_values[0] for graph in graphs if graph.is_complete):
        if names and "" not in names:
            are = "is" if len(names) == 1 else "are"
            named = join_words([f"`{name}`" for name in sorted(names)], "and")
            where = " and ".join(f"present({name})" for name in sorted(names))
            return f"{named} {are} absent at some time: write `{where} implies ...`"
    return ""


def _probe(requirement: Requirement) -> Requirement | None:
    """The requirement "this one is never triggered"; None without a known trigger."""
    when = antecedent(requirement.formula)
    ever = None if when is None else _necessary_condition(when)
    return None if ever is None else replace(requirement, formula=BoolOp("not", (ever,)))


def _necessary_condition(formula: TemporalFormula) -> TemporalFormula | None:
    """A condition on a single tick that must hold at some tick if the formula ever holds.

    None if there is no such condition.
    """
    match formula:
        case Temporal(operands=(*_, operand)):  # of `since`, what began it
            return _necessary_condition(operand)
        case BoolOp(op="and", operands=operands):
            same = tuple(part for part in map(_pointwise_condition, operands) if part is not None)
            found = (BoolOp("and", same),) if same else map(_necessary_condition, operands)
            return next((part for part in found if part is not None), None)
        case BoolOp(op="or", operands=operands):
            parts = tuple(part for part in map(_necessary_condition, operands) if part is not None)
            return BoolOp("or", parts) if len(parts) == len(operands) else None
    return formula if is_timeless(formula) else None


def _pointwise_condition(formula: TemporalFormula) -> TemporalFormula | None:
    """A condition on a single tick that holds wherever a formula holds."""
    if isinstance(formula, Temporal) and formula.op in ("historically", "throughout"):
        return _pointwise_condition(formula.operands[0])
    return formula if is_timeless(formula) else None


def _is_proved(graphs: Sequence[Graph], index: int) -> bool:
    return any(graph.is_complete and _tracker(graph).proves(index) for graph in graphs)
