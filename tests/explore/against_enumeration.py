"""What `specc explore` says of a small system, against all that the system can do."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from specc.tools.explore.explorer import Exploration
from specc.tools.explore.findings import TracedFinding
from tests.explore.enumeration import Enumeration
from tests.explore.formulas import Formula, Memory

WAITING = ("W1001", "W1002", "W1003", "W1004", "W1005")
Node = tuple[int, Memory]


@dataclass(frozen=True, slots=True)
class Judged:
    """What all runs make of a requirement."""

    can_fail: bool
    can_hold: bool
    """Whether some run goes on for ever without violating it; None in doubt."""
    is_asked: bool
    """Whether `p` ever holds."""


def judged(there: Enumeration, formula: Formula) -> Judged:
    """What all runs make of a requirement; those beyond what was enumerated may hold."""
    step = formula.judge(there.system.tick_s)
    truths = [formula.truths(there.view(number)) for number in range(len(there.configurations))]
    fails = False

    def onward(number: int, memory: Memory) -> Node | None:
        nonlocal fails
        after, failed = step(memory, *truths[number])
        fails |= failed
        return None if failed else (number, after)

    first = {onward(edge.target, None) for edge in there.first} - {None}
    following: dict[Node, set[Node]] = {}
    waiting = [node for node in first if node is not None]
    while waiting:
        node = waiting.pop()
        if node in following:
            continue
        number, memory = node
        following[node] = set()
        if number >= len(there.edges):
            following[node].add(node)  # nobody knows how it goes on
            continue
        for edge in there.edges[number]:
            after = onward(edge.target, memory)
            if after is not None:
                following[node].add(after)
                waiting.append(after)
    return Judged(fails, _goes_on(following), any(p for p, _ in truths))


def _goes_on(following: dict[Node, set[Node]]) -> bool:
    """Whether a graph has a path that does not end."""
    before: dict[Node, list[Node]] = {node: [] for node in following}
    left = {}
    for node, after in following.items():
        left[node] = len(after)
        for each in after:
            before[each].append(node)
    ends = [node for node, count in left.items() if count == 0]
    for node in ends:
        for each in before[node]:
            left[each] -= 1
            if left[each] == 0:
                ends.append(each)
    return len(ends) < len(following)


def disagreements(
    said: Exploration, there: Enumeration, formulas: list[Formula], counts: Counter[str]
) -> Iterator[str]:
    """Where the two disagree; `counts` are added to, by what was compared."""
    for verdict, formula in zip(said.requirements, formulas, strict=True):
        truth = judged(there, formula)
        counts[verdict.verdict] += 1
        counts["can fail"] += truth.can_fail
        if verdict.verdict == "proved" and truth.can_fail:
            yield f"{formula.text}: proved, but some run violates it"
        if verdict.verdict == "violated" and truth.can_hold and there.is_complete:
            yield f"{formula.text}: violated, but some run never violates it"
        never_asked = verdict.verdict == "proved" and not verdict.is_triggered
        counts["never asked"] += never_asked
        if never_asked and formula.asks and truth.is_asked:
            yield f"{formula.text}: never asked, but some run asks it"
    yield from _lost(said, there, counts)
    if there.is_complete:
        yield from _stuck(said, there, counts)
    for finding in said.findings:
        counts[f"{finding.code} {finding.trace.is_decided}"] += 1
        if finding.trace.is_decided:
            yield from _not_certain(finding, there)


def _lost(said: Exploration, there: Enumeration, counts: Counter[str]) -> Iterator[str]:
    """Events that are lost, and no finding or doubt says so."""
    lost = {each for edges in there.edges for edge in edges for each in edge.lost}
    told = set[tuple[str, str]]()
    for finding in (f for f in said.findings if f.code == "W1005"):
        _, machine, element, *_ = finding.identity
        if isinstance(element, tuple):
            told.add((str(machine), "_".join(map(str, element))))
    for each in lost:
        counts["lost"] += 1
        if each not in told and _is_complete(said, each[0]):
            yield f"{each} is lost, and nothing says so"


def _is_complete(said: Exploration, machine: str) -> bool:
    """Whether the slices with a machine are explored completely."""
    return all(each.complete for each in said.slices if machine in each.names)


def _stuck(said: Exploration, there: Enumeration, counts: Counter[str]) -> Iterator[str]:
    """Machines that never leave a state any more, and no finding or doubt says so."""
    resting = {
        (machine.name, state)
        for machine in there.machines
        for state in machine.subsystem.sends
        if not any(
            row.source == state and row.target != state for row in machine.subsystem.transitions
        )
    }
    told = {f.code for f in said.findings}
    for name, state, numbers in there.stuck():
        if (name, state) in resting or told.intersection(WAITING):
            continue
        if not any(name in each.names for each in said.slices) or not _is_complete(said, name):
            continue
        ends = there.reached_from(numbers)
        at_rest = any(
            (machine.name, there.configurations[n].parts[i].local[0]) in resting
            for n in ends
            for i, machine in enumerate(there.machines)
            if machine.subsystem.transitions
        )
        doubted = any(
            (name, state) == (machine, there_too)
            for each in said.slices
            for machine, there_too, _ in each.undecided_conditions
        ) or any(each.widened for each in said.slices)
        counts["stuck, but intended" if at_rest else "stuck, but told" if doubted else "stuck"] += 1
        if not at_rest and not doubted:
            yield f"{name} never leaves {state}, and nothing says so"


def _not_certain(finding: TracedFinding, there: Enumeration) -> Iterator[str]:
    """What some run does instead, where a finding says that each comes to it."""
    steps: dict[int, dict[str, tuple[str, int]]] = {}
    tick_s = there.system.tick_s
    passed = Counter[str]()
    ticks = {machine.name: machine.ticks for machine in there.machines}
    for step in finding.trace.steps:
        name = step.walker.name
        tick = passed[name] * ticks[name]
        passed[name] += 1
        steps.setdefault(tick, {})[name] = step.transition.target, step.transition.row
    last = max(steps, default=0)
    assert tick_s
    here, edges = set[int](), there.first
    for tick in range(last + 1):
        if tick:
            if any(number >= len(there.edges) for number in here):
                return
            edges = [edge for number in here for edge in there.edges[number]]
        for edge in edges:
            for move in edge.moves:
                expected = steps.get(tick, {}).get(move.name)
                if expected is not None and expected != (move.target, move.row):
                    yield f"{finding.message}: {expected} at {tick}, but some run has {move}"
                    return
        here = {edge.target for edge in edges}
    if finding.code in ("W1001", "W1003", "W1004") and finding.identity[-1] != "task":
        _, name, state = finding.identity
        index = [machine.name for machine in there.machines].index(str(name))
        for number in there.reached_from(here):
            now = there.configurations[number].parts[index].local[0]
            if now != state:
                yield f"{finding.message}: but some run comes to {now}"
                return
