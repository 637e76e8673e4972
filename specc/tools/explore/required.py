"""Requirements as goals of exploring: proved, violated on some trace, or not decided.

Each requirement is explored alone, with all machines that influence it. So no other requirement
changes its verdict.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from specc.analysis import Facts
from specc.analysis.rates import base_tick
from specc.diagnostics.phrases import join_words
from specc.model.requirement import (
    Junction,
    Requirement,
    Temporal,
    TemporalFormula,
    antecedent,
    is_timeless,
    reach_s,
)
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.findings import TracedFinding
from specc.tools.explore.graph import Graph
from specc.tools.explore.monitor import Monitor, NotFollowedError, TruthValue
from specc.tools.explore.refine import Told, not_refuted, refined
from specc.tools.explore.response import Pending, responses
from specc.tools.explore.trace import ExploredTrace, trace
from specc.tools.explore.watch import Watch

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
    """Whether some run may ask it; if not, it holds vacuously."""
    fails: bool = False
    """Whether a step that fails leaves it open on some trace."""
    is_short: bool = False
    """Whether it is not explored completely whether what is awaited can come."""
    is_dead_end: bool = False
    """Whether measurements can lead to where what is awaited cannot come any more."""

    @property
    def rests_on(self) -> tuple[str, ...]:
        """The conditions on which a violation rests."""
        return self.finding.way.free if self.finding else ()

    def words(self) -> str:
        """The verdict."""
        if self.verdict == "open":
            return f"rests on {join_words(self.rests_on, 'and')}"
        if self.verdict == "not decided":
            return f"not decided, since {self.why or _unknown(self.requirement)}"
        if not self.is_triggered:
            return "proved, but never asked"
        if self.fails and self.verdict == "proved":
            return "proved until a step fails"
        if self.verdict == "violated":
            return "violated in every run, unless a step fails by then"
        return self.verdict


def _unknown(requirement: Requirement) -> str:
    """Which values of a requirement no exploring knows."""
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
    """A requirement that monitors can follow, with all machines that influence what it reads."""

    requirement: Requirement
    names: tuple[str, ...]
    abstraction: Abstraction


def subjects(facts: Facts) -> list[RequirementSlice]:
    """The requirements that monitors can follow, those about single ticks first."""
    found = []
    for requirement in facts.system.requirements:
        asked = {x.subsystem for x in requirement.readings if x.kind != "reported"}
        abstraction = Abstraction(facts, [requirement])
        names = abstraction.around(asked)
        if names and is_followed(requirement):
            found.append(RequirementSlice(requirement, names, abstraction))
    return sorted(found, key=lambda each: not is_timeless(each.requirement.formula))


def undecided(requirement: Requirement) -> RequirementVerdict:
    """The verdict on a requirement that is in no group."""
    if is_followed(requirement):
        return RequirementVerdict(requirement, "not decided")
    return RequirementVerdict(requirement, "not decided", why="it looks ahead from the past")


def is_followed(requirement: Requirement) -> bool:
    """Whether a monitor can follow it while machines are stepped."""
    try:
        return bool(Monitor(requirement, base_tick(())))
    except NotFollowedError:
        return False


def judged(
    subject: RequirementSlice, budget: int
) -> tuple[RequirementVerdict, list[TracedFinding], list[Graph]]:
    """The verdict on a requirement, its findings, and the graphs."""
    requirement, abstraction = subject.requirement, subject.abstraction
    probe = _probe(requirement)
    probes = () if probe is None else (probe,)

    def build(precision: Precision, budget: int, *, still: bool = False) -> Graph:
        made = Composition(
            subject.names, abstraction, precision, watched=[requirement], probes=probes, still=still
        )
        return Graph(made, budget)

    def look(graph: Graph) -> dict[int, TracedFinding]:
        return {index: _way(graph, requirement) for index in graph.violated}

    told = refined(build, look, budget)
    graphs = [graph for graph, _ in told]
    last = graphs[-1]
    if not (last.complete or last.broken_off):
        # With deadlines too distant for all traces, a single trace may still show the awaited one.
        one = build(Precision(exact=True), budget, still=True)
        told.insert(0, (one, look(one)))
    way, exactly = not_refuted(told).get(0, (None, False))
    verdict = _verdict(graphs, requirement, way)
    is_asked = not (verdict == "proved" and probes and _is_proved(graphs, 1))
    why = ""
    if verdict == "not decided":
        why, way = _untold(way) if way else _absent(graphs), None
    ends = _dead_ends(subject, budget // 2) if verdict == "open" else []
    is_dead_end = bool(left := not_refuted(ends))
    if way is not None and is_dead_end:
        found, exactly = left[0]
        # That nothing is asked anew rests on conditions, too.
        free = found.way.free or way.way.free
        way, verdict = replace(found, way=replace(found.way, free=free)), "may be violated"
    findings = []
    if way is not None and verdict != "open":
        findings.append(replace(way, is_confirmed=exactly or way.way.is_decided))
    said = RequirementVerdict(
        requirement,
        verdict,
        way,
        why,
        is_triggered=is_asked,
        fails=any(_watch(graph).ends_early(0) for graph in graphs),
        is_short=bool(ends) and not is_dead_end and not any(graph.complete for graph, _ in ends),
        is_dead_end=is_dead_end,
    )
    return said, findings, [graph for graph, _ in (*told, *ends)]


def _dead_ends(subject: RequirementSlice, budget: int) -> Told[int, TracedFinding]:
    """Graphs with the finding, as 0, on an answer that cannot come any more, if there is one."""
    requirement, abstraction = subject.requirement, subject.abstraction
    every = list(responses(requirement.formula))
    at_once = [replace(requirement, formula=each.at_once, lasts=True) for each in every]
    probes = [
        replace(at_once[0], formula=f) for each in every for f in (each.antecedent, each.answer)
    ]

    def build(precision: Precision, budget: int) -> Graph:
        made = Composition(subject.names, abstraction, precision, watched=at_once, probes=probes)
        return Graph(made, budget)

    def look(graph: Graph) -> dict[int, TracedFinding]:
        for index, response in enumerate(every):
            first = len(at_once) + 2 * index
            asked, answered = (_truths(graph, place) for place in (first, first + 1))
            begins = range(len(asked)) if requirement.lasts else (0,)
            starts = [n for n in begins if asked[n] is True and answered[n] is False]
            if not requirement.lasts:  # nothing is asked after the start
                asked = [False] * len(asked)
            end = Pending(graph, asked, answered, response.deadline_s).dead_end(starts)
            if end is not None:
                way = trace(graph, end.start, *end.way)
                return {0: _finding(requirement, way, unless_anew=end.unless_anew)}
        return {}

    return refined(build, look, budget) if every else []


def _truths(graph: Graph, index: int) -> list[TruthValue]:
    """Whether a requirement about single ticks holds in each configuration."""
    watch, locals_of = _watch(graph), graph.composition.locals_of
    return [watch.truth(index, c.watched, locals_of(c)) for c in graph.configurations]


def _watch(graph: Graph) -> Watch:
    assert graph.composition.watch is not None  # requirements are followed
    return graph.composition.watch


def _way(graph: Graph, requirement: Requirement) -> TracedFinding:
    """The finding on a violation, with the easiest trace to it."""
    number, edges = graph.violation(0)
    return _finding(requirement, trace(graph, number, *edges))


def _finding(
    requirement: Requirement, way: ExploredTrace, *, unless_anew: bool = False
) -> TracedFinding:
    states = {step.walker.name: step.move.target for step in way.steps}
    asked = dict.fromkeys(x.subsystem for x in requirement.readings)
    there = ", ".join(f"`{name}` in `{states[name]}`" for name in asked if name in states)
    what = "can no longer be met" if reach_s(requirement.formula) else "is violated"
    but = ", unless the request is made again" if unless_anew else ""
    return TracedFinding(
        ("W1007", requirement.that, requirement.place),
        "W1007",
        f"this requirement {what} {float(way.time_s):g} s after the start{but}, with {there}",
        requirement.place,
        f"because: {requirement.because}",
        "change what the machines do on this way, or require less",
        way,
    )


def _verdict(
    graphs: Sequence[Graph], requirement: Requirement, way: TracedFinding | None
) -> RequirementStatus:
    if way is not None:
        if way.way.is_decided:
            return "violated"
        # Answers in time rest on plants; the exclusion of a state does not.
        if not reach_s(requirement.formula):
            return "may be violated"
        return "open" if way.way.rests_on_measurements else "not decided"
    if _is_proved(graphs, 0):
        return "proved"
    return "not decided" if any(graph.complete for graph in graphs) else "not explored"


def _untold(way: TracedFinding) -> str:
    """Why a violation that rests on conditions is none that rests on measurements."""
    return (
        f"its violation rests on {join_words(way.way.free, 'and')}, which nothing measured decides"
    )


def _absent(graphs: Sequence[Graph]) -> str:
    """Which values of the requirement are absent, if it would be decided with them."""
    for names in (_watch(graph).lacking[0] for graph in graphs if graph.complete):
        if names and "" not in names:
            are = "is" if len(names) == 1 else "are"
            named = join_words([f"`{name}`" for name in sorted(names)], "and")
            there = " and ".join(f"present({name})" for name in sorted(names))
            return f"{named} {are} absent at some time: write `{there} implies ...`"
    return ""


def _probe(requirement: Requirement) -> Requirement | None:
    """The requirement "this one is never asked"; None if it always is, or if none is known."""
    when = antecedent(requirement.formula)
    ever = None if when is None else _ever(when)
    return None if ever is None else replace(requirement, formula=Junction("not", (ever,)))


def _ever(formula: TemporalFormula) -> TemporalFormula | None:
    """A condition on single ticks that holds at some tick if a formula ever does; None if none."""
    match formula:
        case Temporal(operands=(*_, operand)):  # of `since`, what began it
            return _ever(operand)
        case Junction(op="and", operands=operands):
            same = tuple(part for part in map(_now, operands) if part is not None)
            found = (Junction("and", same),) if same else map(_ever, operands)
            return next((part for part in found if part is not None), None)
        case Junction(op="or", operands=operands):
            parts = tuple(part for part in map(_ever, operands) if part is not None)
            return Junction("or", parts) if len(parts) == len(operands) else None
    return formula if is_timeless(formula) else None


def _now(formula: TemporalFormula) -> TemporalFormula | None:
    """A condition on a single tick that holds wherever a formula holds."""
    if isinstance(formula, Temporal) and formula.op in ("historically", "throughout"):
        return _now(formula.operands[0])
    return formula if is_timeless(formula) else None


def _is_proved(graphs: Sequence[Graph], index: int) -> bool:
    return any(graph.complete and _watch(graph).proves(index) for graph in graphs)
