"""Requirements as goals of exploring: proved, violated on some trace, or not decided.

Requirements about the same machines are explored together, with all machines that influence these.
Requirements about single ticks add no configurations. They go first, apart from temporal ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from operator import itemgetter
from typing import Literal

from specc.analysis import Facts
from specc.analysis.rates import base_tick
from specc.diagnostics.phrases import listed
from specc.frozen import frozen, mutable
from specc.model.requirement import (
    Junction,
    Requirement,
    Temporal,
    TemporalFormula,
    asked,
    is_timeless,
    reach_s,
)
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.findings import Found, TracedFinding
from specc.tools.explore.graph import Graph
from specc.tools.explore.monitor import Monitor, NotFollowedError
from specc.tools.explore.refine import not_refuted, refined
from specc.tools.explore.trace import ExploredTrace, trace

RequirementStatus = Literal[
    "proved", "violated", "may be violated", "open", "not decided", "not explored"
]

MOST_NAMED = 3
"""Measurements that a verdict names."""


@frozen
class RequirementVerdict:
    """The verdict on a requirement, and the trace on which it is violated, if there is one."""

    requirement: Requirement
    verdict: RequirementStatus
    finding: TracedFinding | None = None
    why: str = ""
    """The reason of `not decided`, if it lies in the formula and not in the values."""
    asked: bool = True
    """Whether some run may ask it; if not, it holds vacuously."""

    @property
    def rests_on(self) -> tuple[str, ...]:
        """The conditions on which a violation rests."""
        return self.finding.way.free if self.finding else ()

    def words(self) -> str:
        """The verdict."""
        if self.verdict == "open":
            return f"rests on {listed(self.rests_on, 'and')}"
        if self.verdict == "not decided":
            return f"not decided, since {self.why or _unknown(self.requirement)}"
        if not self.asked:
            return "proved, but never asked"
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
    return f"{listed(named, 'and')} {'is' if len(found) == 1 else 'are'} measured"


@mutable
class Group:
    """Requirements about the same machines, all about single ticks or all temporal."""

    names: tuple[str, ...]
    requirements: list[Requirement]


def groups(facts: Facts) -> list[Group]:
    """The requirements that monitors can follow, in groups."""
    found: dict[tuple[bool, tuple[str, ...]], Group] = {}
    for requirement in facts.system.requirements:
        asked = {x.subsystem for x in requirement.readings if x.kind != "reported"}
        names = Abstraction(facts, [requirement]).around(asked)
        if names and is_followed(requirement):
            key = not is_timeless(requirement.formula), names
            found.setdefault(key, Group(names, [])).requirements.append(requirement)
    return [found[key] for key in sorted(found, key=itemgetter(0))]


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
    group: Group, facts: Facts, budget: int
) -> tuple[list[RequirementVerdict], list[TracedFinding], list[Graph]]:
    """The verdicts on the requirements of a group, their findings, and the graphs."""
    abstraction = Abstraction(facts, group.requirements)

    probes = {i: probe for i, r in enumerate(group.requirements) if (probe := _probe(r))}

    def build(precision: Precision, budget: int, *, still: bool = False) -> Graph:
        watched = group.requirements
        others = tuple(probes.values())
        made = Composition(
            group.names, abstraction, precision, watched=watched, probes=others, still=still
        )
        return Graph(made, budget)

    def look(graph: Graph) -> dict[int, TracedFinding]:
        return {index: _way(graph, index, group, abstraction) for index in graph.violated}

    told = refined(build, look, budget)
    graphs = [graph for graph, _ in told]
    last = graphs[-1]
    if not (last.complete or last.broken_off):
        # With deadlines too distant for all traces, a single trace may still show the awaited one.
        one = build(Precision(exact=True), budget, still=True)
        told.insert(0, (one, look(one)))
    left = not_refuted(told)
    said, findings = [], []
    for index, requirement in enumerate(group.requirements):
        way, exactly = left.get(index, (None, False))
        verdict = _verdict(graphs, index, requirement, way)
        place = len(group.requirements) + [*probes].index(index) if index in probes else -1
        is_asked = not (verdict == "proved" and place >= 0 and _is_proved(graphs, place))
        why = _absent(graphs, index) if verdict == "not decided" else ""
        said.append(RequirementVerdict(requirement, verdict, way, why, asked=is_asked))
        if way is not None and verdict != "open":
            findings.append(replace(way, is_confirmed=exactly or way.way.is_decided))
    return said, findings, [graph for graph, _ in told]


def _way(graph: Graph, index: int, group: Group, abstraction: Abstraction) -> TracedFinding:
    """The finding on a violation, with the easiest trace to it."""
    number, edges = graph.violation(index)
    found = Found(graph, abstraction)
    found.add(_finding(group.requirements[index], trace(graph, number, *edges)))
    (finding,) = found.findings.values()
    return finding


def _finding(requirement: Requirement, way: ExploredTrace) -> TracedFinding:
    states = {step.walker.name: step.move.target for step in way.steps}
    asked = dict.fromkeys(x.subsystem for x in requirement.readings)
    there = ", ".join(f"`{name}` in `{states[name]}`" for name in asked if name in states)
    what = (
        "nothing meets this requirement any more"
        if reach_s(requirement.formula)
        else ("this requirement is violated")
    )
    return TracedFinding(
        ("W1007", requirement.that, requirement.place),
        "W1007",
        f"{what} {float(way.time_s):g} s after the start, with {there}",
        requirement.place,
        f"because: {requirement.because}",
        "change what the machines do on this way, or require less",
        way,
    )


def _verdict(
    graphs: Sequence[Graph], index: int, requirement: Requirement, way: TracedFinding | None
) -> RequirementStatus:
    if way is not None:
        if way.way.is_decided:
            return "violated"
        # Answers in time rest on plants; the exclusion of a state does not.
        return "open" if reach_s(requirement.formula) else "may be violated"
    if _is_proved(graphs, index):
        return "proved"
    return "not decided" if any(graph.complete for graph in graphs) else "not explored"


def _absent(graphs: Sequence[Graph], index: int) -> str:
    """Which values of a requirement are absent, if it would be decided with them."""
    watches = [graph.composition.watch for graph in graphs if graph.complete]
    for names in (watch.lacking[index] for watch in watches if watch is not None):
        if names and "" not in names:
            are = "is" if len(names) == 1 else "are"
            named = listed([f"`{name}`" for name in sorted(names)], "and")
            there = " and ".join(f"present({name})" for name in sorted(names))
            return f"{named} {are} absent at some time: write `{there} implies ...`"
    return ""


def _probe(requirement: Requirement) -> Requirement | None:
    """The requirement "this one is never asked"; None if it always is, or if none is known."""
    when = asked(requirement.formula)
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
    return any(graph.complete and _always_holds(graph, index) for graph in graphs)


def _always_holds(graph: Graph, index: int) -> bool:
    watch = graph.composition.watch
    return watch is not None and watch.proves(index)
