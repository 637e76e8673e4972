"""Requirements as goals of exploring: proved, violated on some trace, or not decided.

Each requirement is explored alone, with all machines that influence it. So no other requirement
changes its verdict.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from specc.analysis import Facts
from specc.analysis.rates import base_tick
from specc.diagnostics.phrases import join_words
from specc.model import expr as m
from specc.model.requirement import (
    BoolOp,
    Requirement,
    Stays,
    Temporal,
    TemporalFormula,
    TickCondition,
    antecedent,
    horizon_s,
    is_timeless,
)
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.findings import TracedFinding
from specc.tools.explore.graph import Graph
from specc.tools.explore.monitor import Monitor, TruthValue, UnsupportedFormulaError
from specc.tools.explore.refine import not_refuted, refine
from specc.tools.explore.trace import ExploredTrace, easiest_trace
from specc.tools.explore.tracker import RequirementTracker

RequirementStatus = Literal[
    "proved", "violated", "may be violated", "open", "not decided", "not explored"
]

VIOLATED_SHARE = 8
"""Where one trace violates a requirement, all traces get one part in so many of the budget."""
MEASURED = "reported", "observed"
"""The kinds of readings that exploring never knows."""
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
    found = dict.fromkeys(f"`{x.name}`" for x in requirement.readings if x.kind in MEASURED)
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


def is_monitorable(requirement: Requirement) -> bool:
    """Whether a monitor can evaluate it while machines are stepped."""
    try:
        return bool(Monitor(requirement, base_tick(())))
    except UnsupportedFormulaError:
        return False


def possible_truths(requirement: Requirement) -> set[TruthValue]:
    """The truth values that a formula may have, if measurements are never known."""
    measured = {x.name for x in requirement.readings if x.kind in MEASURED}

    def of_expr(expr: m.Expr) -> set[TruthValue]:
        match expr:
            case m.Unary(op="not", operand=operand):
                return {None if truth is None else not truth for truth in of_expr(operand)}
            case m.Logic(op=op, operands=operands):
                return _junction(op, map(of_expr, operands))
        names = {leaf.name for leaf in m.walk(expr) if isinstance(leaf, m.MemoryRef)}
        return {True, False, None} if names.isdisjoint(measured) else {None}

    def of(formula: TemporalFormula) -> set[TruthValue]:
        match formula:
            case TickCondition(that=that):
                return of_expr(that)
            case BoolOp(op="not", operands=(operand,)):
                return {None if truth is None else not truth for truth in of(operand)}
            case BoolOp(op="and" | "or" as op, operands=operands):
                return _junction(op, map(of, operands))
            case Stays():
                return {True, False, None}
        return set[TruthValue]().union(*map(of, formula.operands))

    return of(requirement.formula)


def _junction(op: str, parts: Iterable[set[TruthValue]]) -> set[TruthValue]:
    """The truth values of a conjunction or a disjunction of independent parts."""
    absorbing, each = op == "or", list(parts)
    found: set[TruthValue] = {absorbing} if any(absorbing in part for part in each) else set()
    others = [part - {absorbing} for part in each]
    if all(others):
        found |= {None} if any(None in part for part in others) else set()
        found |= {not absorbing} if all((not absorbing) in part for part in others) else set()
    return found


@dataclass(frozen=True, slots=True)
class JudgedRequirement:
    """The verdict on a requirement, its findings, and the graphs."""

    verdict: RequirementVerdict
    findings: tuple[TracedFinding, ...]
    graphs: Sequence[Graph]

    @classmethod
    def of(
        cls, verdict: RequirementVerdict, graphs: Sequence[Graph], *, is_exact: bool
    ) -> JudgedRequirement:
        """A violation that rests on nothing measured is a finding."""
        violation, findings = verdict.finding, list[TracedFinding]()
        if violation is not None and verdict.verdict != "open":
            is_confirmed = is_exact or violation.trace.is_decided
            findings.append(replace(violation, is_confirmed=is_confirmed))
        return cls(verdict, tuple(findings), graphs)


def judge(subject: RequirementSlice, budget: int) -> JudgedRequirement:
    """The judgement of a requirement by a monitor."""
    requirement, abstraction = subject.requirement, subject.abstraction
    trigger = trigger_of(requirement)
    probes = [replace(requirement, formula=BoolOp("not", (trigger,)))] if trigger else []

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
        if 0 not in graph.violated:
            return {}
        number, edges = graph.violation(0)
        return {0: violation_finding(requirement, easiest_trace(graph, number, *edges))}

    # With deadlines too distant for all traces, a single trace may still show the awaited one.
    single = build(Precision(counts_time=True), budget, only_forced=True)
    seen = look(single)
    share = budget // VIOLATED_SHARE if seen else budget
    results = refine(build, look, share, lambda graph: _tracker(graph).proves(0))
    graphs = [graph for graph, _ in results]
    if not (graphs[-1].is_complete or graphs[-1].broken_off):
        results.insert(0, (single, seen))
    violation, is_exact = not_refuted(results).get(0, (None, False))
    verdict, why = verdict_of(requirement, violation, graphs, is_proved=_is_proved(graphs, 0))
    is_asked = not (verdict == "proved" and probes and _is_proved(graphs, 1))
    if verdict == "not decided":
        violation = None
    judged = RequirementVerdict(
        requirement,
        verdict,
        violation,
        why,
        is_triggered=is_asked,
        may_end_early=any(_tracker(graph).ends_early(0) for graph in graphs),
    )
    return JudgedRequirement.of(judged, [graph for graph, _ in results], is_exact=is_exact)


def _tracker(graph: Graph) -> RequirementTracker:
    assert graph.composition.tracker is not None  # requirements are followed
    return graph.composition.tracker


def violation_finding(
    requirement: Requirement, trace: ExploredTrace, *, can_retry: bool = False
) -> TracedFinding:
    """The finding on a trace that violates a requirement."""
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


def verdict_of(
    requirement: Requirement,
    violation: TracedFinding | None,
    graphs: Sequence[Graph],
    *,
    is_proved: bool,
) -> tuple[RequirementStatus, str]:
    """The verdict by a violation and the graphs without any, with the reason if it is undecided."""
    if violation is not None:
        if violation.trace.is_decided:
            return "violated", ""
        # Answers in time rest on plants; the exclusion of a state does not.
        if not horizon_s(requirement.formula):
            return "may be violated", ""
        if violation.trace.rests_on_measurements:
            return "open", ""
        return "not decided", _undecidable_reason(violation)
    if is_proved:
        return "proved", ""
    is_complete = any(graph.is_complete for graph in graphs)
    # What no trace can violate is at most proved, for which measurements are hardly ever enough.
    if is_complete or False not in possible_truths(requirement):
        return "not decided", _absent_values(graphs)
    return "not explored", ""


def _undecidable_reason(violation: TracedFinding) -> str:
    """Why a violation that rests on conditions does not rest on measurements."""
    choices = join_words(violation.trace.choices, "and")
    return f"its violation rests on {choices}, which nothing measured decides"


def _absent_values(graphs: Sequence[Graph]) -> str:
    """Which values of the requirement are absent, if it would be decided with them."""
    trackers = (graph.composition.tracker for graph in graphs if graph.is_complete)
    for names in (set[str]().union(*each.absent_values) for each in trackers if each):
        if names and "" not in names:
            are = "is" if len(names) == 1 else "are"
            named = join_words([f"`{name}`" for name in sorted(names)], "and")
            where = " and ".join(f"present({name})" for name in sorted(names))
            return f"{named} {are} absent at some time: write `{where} implies ...`"
    return ""


def trigger_of(requirement: Requirement) -> TemporalFormula | None:
    """What must hold at some tick if a requirement is ever asked, if known."""
    when = antecedent(requirement.formula)
    return None if when is None else _necessary_condition(when)


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
