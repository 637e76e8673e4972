"""Requirements as goals of exploring: proved, violated on some way, or not decided by what is kept.

Requirements about the same machines are explored together, and these with all that influence them.
Those about single ticks add no states; they go first, apart from those that look back or ahead.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Literal

from specc.analysis import Facts
from specc.analysis.rates import base_tick
from specc.diagnostics.phrases import listed
from specc.model.requirement import Requirement, is_timeless, reach_s
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition
from specc.tools.explore.findings import Finding, Found
from specc.tools.explore.graph import Graph
from specc.tools.explore.monitor import Monitor, NotFollowedError
from specc.tools.explore.trace import Trace, trace

FOR_TIME = 8
"""One part in so many is for counting time, where there are only too many ways without it."""
Verdict = Literal["proved", "violated", "may be violated", "open", "not decided", "not explored"]


@dataclass(frozen=True, slots=True)
class Judged:
    """What exploring says of a requirement; the conditions on which a violation rests."""

    requirement: Requirement
    verdict: Verdict
    rests_on: tuple[str, ...] = ()

    def words(self) -> str:
        """The verdict."""
        if self.verdict == "open":
            return f"rests on {listed(self.rests_on, 'and')}"
        if self.verdict == "not decided":
            return "not decided, since it is about values that are not known"
        return self.verdict


@dataclass(slots=True)
class Group:
    """Requirements that are explored together: about the same machines, all timeless or none."""

    names: tuple[str, ...]
    requirements: list[Requirement]


def groups(facts: Facts) -> list[Group]:
    """The requirements that can be followed."""
    found: dict[tuple[bool, tuple[str, ...]], Group] = {}
    for requirement in facts.system.requirements:
        asked = {x.subsystem for x in requirement.readings if x.kind != "reported"}
        names = Abstraction(facts, [requirement]).around(asked)
        if names and _is_followed(requirement):
            key = not is_timeless(requirement.formula), names
            found.setdefault(key, Group(names, [])).requirements.append(requirement)
    return [found[key] for key in sorted(found, key=itemgetter(0))]


def _is_followed(requirement: Requirement) -> bool:
    try:
        return bool(Monitor(requirement, base_tick(())))
    except NotFollowedError:
        return False


def judged(
    group: Group, facts: Facts, budget: int
) -> tuple[list[Judged], list[Finding], list[Graph]]:
    """What exploring says of the requirements of a group, and what was explored."""
    abstraction = Abstraction(facts, group.requirements)
    graphs = [_graph(group, abstraction, budget, exact=False)]
    again = graphs[0].violated or not graphs[0].complete
    if again and graphs[0].composition.is_timed and not graphs[0].broken_off:
        least = budget if graphs[0].violated else budget // FOR_TIME
        graphs.append(_graph(group, abstraction, least, exact=True))
    best = graphs[-1:]
    if not best[0].complete:
        # Where windows are too long for all ways, one may tell what is waited for, and no more.
        still = () if graphs[-1].broken_off else (_graph(group, abstraction, budget, still=True),)
        best = [*still, *graphs]
    told, findings = [], []
    for index, requirement in enumerate(group.requirements):
        ways = [w for graph in best for w in _ways(graph, index, requirement, abstraction)]
        way = min(ways, key=lambda finding: len(finding.way.free), default=None)
        verdict = _verdict(graphs, index, requirement, way)
        told.append(Judged(requirement, verdict, way.way.free if way else ()))
        if way is not None and verdict != "open":
            findings.append(way)
    return told, findings, best


def _graph(
    group: Group, abstraction: Abstraction, budget: int, *, exact: bool = True, still: bool = False
) -> Graph:
    watched = group.requirements
    made = Composition(group.names, abstraction, exact=exact, watched=watched, still=still)
    return Graph(made, budget)


def _ways(
    graph: Graph, index: int, requirement: Requirement, abstraction: Abstraction
) -> Sequence[Finding]:
    """The easiest way to a violation, unless bounds of ours made it."""
    if index not in graph.violated:
        return ()
    number, edges = graph.violation(index)
    way = trace(graph, number, *edges)
    found = Found(graph, abstraction)
    found.add(_finding(requirement, way))
    return list(found.findings.values())


def _finding(requirement: Requirement, way: Trace) -> Finding:
    states = {step.walker.name: step.move.target for step in way.steps}
    asked = dict.fromkeys(x.subsystem for x in requirement.readings)
    there = ", ".join(f"`{name}` in `{states[name]}`" for name in asked if name in states)
    what = (
        "nothing meets this requirement any more"
        if reach_s(requirement.formula)
        else ("this requirement is violated")
    )
    return Finding(
        ("W1007", requirement.that, requirement.place),
        "W1007",
        f"{what} {float(way.time_s):g} s after the start, with {there}",
        requirement.place,
        f"because: {requirement.because}",
        "change what the machines do on this way, or require less",
        way,
    )


def _verdict(
    graphs: Sequence[Graph], index: int, requirement: Requirement, way: Finding | None
) -> Verdict:
    if way is not None:
        if way.way.is_decided:
            return "violated"
        # What machines answer in time rests on plants; what they exclude does not.
        return "open" if reach_s(requirement.formula) else "may be violated"
    complete = [graph for graph in graphs if graph.complete]
    if any(_always_holds(graph, index) for graph in complete):
        return "proved"
    return "not decided" if graphs[-1] in complete else "not explored"


def _always_holds(graph: Graph, index: int) -> bool:
    watch = graph.composition.watch
    return watch is not None and not watch.said[index] & {None, False}
