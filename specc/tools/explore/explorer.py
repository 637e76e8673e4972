"""Explores a whole system, slice by slice, and says what was found and how far it came.

Time in a state is first taken to pass in any way, which is quick. Only what is found then is
looked for again with time counted in periods, since it may rest on timing that cannot be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from specc.analysis import Facts
from specc.diagnostics.phrases import counted
from specc.limits import one_run
from specc.model.fsm import Axiom
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition
from specc.tools.explore.findings import Finding, findings
from specc.tools.explore.graph import BrokenOff, Graph, broken_off
from specc.tools.explore.required import FOR_TIME, Group, Judged, groups, judged
from specc.tools.explore.symmetry import likewise

FOR_REQUIREMENTS = 8
"""One part in so many of the budget is for what is required."""
MOST_ALIKE = 4
"""Machines that are named."""
Verdict = Literal["proved", "refuted", "may fail", "on your word", "not explored"]


@dataclass(frozen=True, slots=True)
class Explored:
    """One slice: how far it was explored, and with time counted or only passing."""

    names: tuple[str, ...]
    configurations: int
    steps: int
    depth_s: float
    complete: bool
    exact: bool
    timed: bool
    """Whether time in a state matters at all."""
    broken_off: BrokenOff
    widened: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()
    """Machines of slices for which this one stands."""

    def words(self) -> str:
        """How far it came, and what was abstracted."""
        what = f"{', '.join(self.names)}: "
        states = counted(self.configurations, "state")
        if self.complete:
            what += f"explored completely: {states}"
        else:
            why = self.broken_off or "stopped"
            what += f"{why} after {states}, {self.depth_s:g} s into the runs"
        if self.timed:
            time = "counted in periods" if self.exact else "taken to pass in any way"
            what += f"; time in states {time}"
        if self.alike:
            shown = (*self.alike[:MOST_ALIKE], "...")[: len(self.alike)]
            what += f"; so for {', '.join(shown)}"
        if self.widened:
            what += f"; values taken for unknown: {', '.join(self.widened)}"
        return what


@dataclass(slots=True)
class Exploration:
    """What came of it: slices, findings, and what is known of the assumptions."""

    slices: list[Explored] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    assumptions: list[tuple[str, Axiom, Verdict]] = field(default_factory=list)
    requirements: list[Judged] = field(default_factory=list)
    alone: tuple[str, ...] = ()
    """Machines that decide nothing."""
    left: list[tuple[str, ...]] = field(default_factory=list)
    """Slices that were not begun since exploring was broken off."""
    broken_off: BrokenOff = ""

    @property
    def is_short(self) -> bool:
        """Whether more steps would explore more."""
        asked = any(judged.verdict == "not explored" for judged in self.requirements)
        complete = all(each.complete for each in self.slices)
        return not self.broken_off and (asked or not complete)


def explore(facts: Facts, budget: int) -> Exploration:
    """Explore a system without errors in so many steps; where time is counted, twice as many.

    Ctrl-C ends it, with what was found until then.
    """
    with one_run():
        return _explore(facts, budget)


def _explore(facts: Facts, budget: int) -> Exploration:
    abstraction = Abstraction(facts)
    result = Exploration()
    found: dict[tuple[object, ...], Finding] = {}
    verdicts: dict[tuple[str, int], set[Verdict]] = {}
    slices, required = likewise(abstraction.slices(), abstraction), groups(facts)
    kept = budget // FOR_REQUIREMENTS if required else 0
    for index, (names, others) in enumerate(slices):
        if result.broken_off:
            result.left.append(names)
            continue
        spent = sum(each.steps for each in result.slices)
        share = max(0, budget - kept - spent) // (len(slices) - index)
        graph = _explored(names, abstraction, facts, share, found)
        alike = tuple(new for same in others for old, new in same.items() if new != old)
        result.slices.append(replace(_summary(graph), alike=alike))
        result.broken_off = graph.broken_off
        for walker in graph.composition.walkers:
            for number in range(len(walker.subsystem.axioms)):
                answers = walker.assumed.get(number, set())
                failing = found.get(("W1006", walker.name, number))
                said = _verdict(answers, failing, complete=graph.complete)
                for same in (walker.name, *(each[walker.name] for each in others)):
                    verdicts.setdefault((same, number), set()).add(said)
    result.findings = [f for f in found.values() if not _is_proved(f, verdicts)]
    result.assumptions = [
        (name, kept.subsystem.axioms[index], _best(said))
        for (name, index), said in sorted(verdicts.items())
        for kept in (abstraction.kept[name],)
    ]
    explored = [*(each.names for each in result.slices), *result.left]
    explored += [each.alike for each in result.slices]
    inside = {name for names in explored for name in names}
    _require(result, required, facts, budget)
    result.alone = tuple(name for name in abstraction.kept if name not in inside)
    return result


def _require(result: Exploration, required: Sequence[Group], facts: Facts, budget: int) -> None:
    """Explore what is required with what is left of the budget."""
    spent = sum(each.steps for each in result.slices)
    # Formulas that look far ahead have as many states as ticks.
    left = min(budget - spent, budget // FOR_REQUIREMENTS)
    told: dict[int, Judged] = {}
    for index, group in enumerate(required):
        told |= {id(r): Judged(r, "not explored") for r in group.requirements}
        if result.broken_off:
            continue
        share = max(0, left) // (len(required) - index)
        try:
            said, there, graphs = judged(group, facts, share)
        except (KeyboardInterrupt, MemoryError) as error:
            result.broken_off = broken_off(error)
            continue
        left -= sum(graph.steps for graph in graphs)
        result.broken_off = next((g.broken_off for g in graphs if g.broken_off), "")
        told |= {id(each.requirement): each for each in said}
        result.findings += there
    result.requirements = [
        told.get(id(requirement), Judged(requirement, "not decided"))
        for requirement in facts.system.requirements
    ]


def _explored(
    names: tuple[str, ...],
    abstraction: Abstraction,
    facts: Facts,
    budget: int,
    found: dict[tuple[object, ...], Finding],
) -> Graph:
    """The graph that says most about a slice; its findings are added to those `found`."""
    best = Graph(Composition(names, abstraction, exact=False), budget)
    there = _found(best, abstraction, facts)
    # Without measurements, time alone makes ways that counting it closes again.
    again = (there or not best.complete) and best.composition.is_timed
    if again and not best.broken_off:
        least = budget if there else budget // FOR_TIME
        counted = Graph(Composition(names, abstraction, exact=True), least)
        confirmed = _found(counted, abstraction, facts)
        there = confirmed if counted.complete else there | confirmed
        best = counted if counted.complete or counted.broken_off else best
    for about, finding in there.items():
        found.setdefault(about, finding)
    return best


def _found(
    graph: Graph, abstraction: Abstraction, facts: Facts
) -> dict[tuple[object, ...], Finding]:
    """What is found in a graph; nothing if looking for it is broken off."""
    try:
        return findings(graph, abstraction, facts.system)
    except (KeyboardInterrupt, MemoryError) as error:
        graph.broken_off = broken_off(error)
    return {}


def _summary(graph: Graph) -> Explored:
    composition = graph.composition
    return Explored(
        composition.names,
        len(graph.configurations),
        graph.steps,
        0.0 if graph.complete else float(graph.depth_s(len(graph.edges))),
        graph.complete,
        composition.exact,
        composition.is_timed,
        graph.broken_off,
        tuple(sorted(composition.widened)),
    )


def _verdict(answers: set[bool | None], failing: Finding | None, *, complete: bool) -> Verdict:
    if False in answers:
        return "refuted" if failing and failing.way.is_decided else "may fail"
    if not complete:
        return "not explored"
    return "on your word" if None in answers else "proved"


_ORDER: tuple[Verdict, ...] = ("proved", "refuted", "on your word", "may fail", "not explored")


def _best(said: set[Verdict]) -> Verdict:
    return min(said, key=_ORDER.index)


def _is_proved(finding: Finding, verdicts: dict[tuple[str, int], set[Verdict]]) -> bool:
    """Whether another slice shows that an assumption holds after all."""
    if finding.code != "W1006":
        return False
    _, name, index = finding.about
    return _best(verdicts[name, index]) == "proved"  # type: ignore[index]  # what W1006 is about
