"""How long runs may stay in a part of a graph, with counters as ranking functions.

In a strongly connected part of a graph a run may stay for ever, unless a counter ends it. Of a
number that counts only regions are known. But while a run stays in a part in which such a number
only grows, by at least some amount at some edges, the ends of its regions bound how often the run
takes these edges. What is left without them is bounded in the same way, by another counter or
since it has no cycle: together the counters are a lexicographic ranking function.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping, Sequence
from math import floor, inf, ulp
from typing import NamedTuple, TypeVar

from specc.analysis.graph import components
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import range_of
from specc.lang.ranges import ANY, Range, negative, union
from specc.model import expr as m
from specc.reachable import grouped, reachable
from specc.tools.explore.partial import KnownValues
from specc.tools.explore.regions import Region
from specc.tools.explore.transitions import Transition

Node = TypeVar("Node", bound=Hashable)
Counter = tuple[int, str]
"""A machine, and a number in its memory."""
Moves = Sequence[tuple[int, Transition]]
"""The transitions on an edge, each with its machine."""
Edges = Sequence[tuple[Node, Moves]]
"""The nodes that follow a node, each with what leads there."""
MOST_NESTED = 12
"""The most counters that end cycles, each within those of another one."""
MOST_ROUNDS = 1_000_000
"""The most steps of one counter in a bound; with more, what floats round would add up."""


def change(expr: m.Expr, memory: str, known: KnownValues, after: Region) -> Range:
    """The range of what an assignment adds to a number in memory that is in a region afterwards."""
    match expr:
        case m.MemoryRef(name=name) if name == memory:
            return 0, 0
        case m.Binary(op="+", left=m.MemoryRef(name=name), right=by) if name == memory:
            return range_of(by, known.range_of)
        case m.Binary(op="+", left=by, right=m.MemoryRef(name=name)) if name == memory:
            return range_of(by, known.range_of)
        case m.Binary(op="-", left=m.MemoryRef(name=name), right=by) if name == memory:
            return negative(range_of(by, known.range_of))
        case m.Choice(then=then, otherwise=otherwise):
            return _change_by_one_of((then, otherwise), memory, known, after)
        case m.Builtin(name=name, args=args) if FUNCTIONS[name].chooses:
            return _change_by_one_of(args, memory, known, after)
    return ANY


def _change_by_one_of(
    exprs: Iterable[m.Expr], memory: str, known: KnownValues, after: Region
) -> Range:
    found = []
    for expr in exprs:
        low, high = range_of(expr, known.range_of)
        if low <= after.high and after.low <= high:
            found.append(change(expr, memory, known, after))
    return union(*found) if found else ANY


def longest_stays(
    nodes: Iterable[Node],
    following: Callable[[Node], Edges[Node]],
    ticks: Callable[[Node], int],
    region: Callable[[Node, Counter], Region | None] | None = None,
) -> dict[Node, int]:
    """For how many ticks runs stay in nodes and what follows them, of which none is left out.

    Nodes where they may stay for ever are missing. A node lasts for `ticks`; `region` is that of
    a number there, if it is known. Without it no counter ends a cycle.
    """
    after: dict[Node, Edges[Node]] = {}

    def targets(node: Node) -> list[Node]:
        after[node] = following(node)
        return [target for target, _ in after[node]]

    reachable(nodes, targets)
    return _stays(after, ticks, region, MOST_NESTED)


def _stays(
    after: Mapping[Node, Edges[Node]],
    ticks: Callable[[Node], int],
    region: Callable[[Node, Counter], Region | None] | None,
    most_nested: int,
) -> dict[Node, int]:
    """The longest stays in the nodes of a graph from which runs leave each cycle.

    A run takes a round in a part with each change of its counter, so the changes of a counter that
    nothing in the graph sets back are shared by all parts that it ends.
    """
    stays = _stays_without_cycles(after, ticks)
    rest = {node: out for node, out in after.items() if node not in stays}
    if region is None or not rest:
        return stays
    inner = {node: [edge for edge in out if edge[0] in rest] for node, out in rest.items()}
    shared = dict(_rounds(inner, region))
    longest_round = dict.fromkeys(shared, 0)
    alone, passing = dict(stays), dict(stays)
    pairs = ((node, target) for node, out in inner.items() for target, _ in out)
    for part in reversed(components([*rest], pairs)):  # each after those that it leads to
        members = {*part.states}
        inside = {
            node: [edge for edge in inner[node] if edge[0] in members] for node in part.states
        }
        leaving = {target for node in inside for target, _ in after[node]} - members
        stay = None
        if leaving <= alone.keys():
            stay = _stay_within(inside, ticks, region, shared, most_nested)
        if stay is not None:
            whole = once = (stay.rounds + 1) * stay.round_ticks
            if stay.counter in shared:
                once = stay.round_ticks
                longest_round[stay.counter] = max(once, longest_round[stay.counter])
            whole += max((alone[target] for target in leaving), default=0)
            once += max((passing[target] for target in leaving), default=0)
            alone |= dict.fromkeys(inside, whole)
            passing |= dict.fromkeys(inside, once)
    rounds = sum(shared[counter] * longest for counter, longest in longest_round.items())
    return {node: min(alone[node], passing[node] + rounds) for node in alone}


def _stays_without_cycles(
    after: Mapping[Node, Edges[Node]], ticks: Callable[[Node], int]
) -> dict[Node, int]:
    """The longest stays in nodes from which no cycle is reached."""
    stays: dict[Node, int] = {}
    before = grouped((target, here) for here, out in after.items() for target, _ in out)
    remaining = {node: len(out) for node, out in after.items()}
    waiting = [node for node, count in remaining.items() if not count]
    while waiting:
        node = waiting.pop()
        longest = max((stays[target] for target, _ in after[node]), default=0)
        stays[node] = ticks(node) + longest
        for earlier in before.get(node, ()):
            remaining[earlier] -= 1
            if not remaining[earlier]:
                waiting.append(earlier)
    return stays


class _Stay(NamedTuple):
    """How long a run stays in a part of a graph: rounds that a counter ends, and ticks of one."""

    counter: Counter | None
    rounds: int
    round_ticks: int


def _stay_within(
    after: Mapping[Node, Edges[Node]],
    ticks: Callable[[Node], int],
    region: Callable[[Node, Counter], Region | None],
    preferred: Collection[Counter],
    most_nested: int,
) -> _Stay | None:
    """How long a run stays in strongly connected nodes; None if it may stay for ever."""
    if not any(after.values()):
        return _Stay(None, 0, sum(map(ticks, after)))
    bounds = _rounds(after, region)
    if not bounds or not most_nested:
        return None
    # Any other one still bounds what is left.
    counter, rounds = min(bounds, key=lambda each: (each[0] not in preferred, each[1], each[0]))
    rest = {
        node: [(target, moves) for target, moves in out if not _change_of(counter, moves)]
        for node, out in after.items()
    }
    stays = _stays(rest, ticks, region, most_nested - 1)
    return _Stay(counter, rounds, max(stays.values())) if len(stays) == len(after) else None


def _rounds(
    after: Mapping[Node, Edges[Node]], region: Callable[[Node, Counter], Region | None]
) -> list[tuple[Counter, int]]:
    """The counters that only grow, or only shrink, in a graph, and how often they do."""
    every = [moves for out in after.values() for _, moves in out]
    found = []
    for counter in {(i, name) for moves in every for i, move in moves for name, _ in move.counts}:
        changes = [_change_of(counter, moves) for moves in every]
        rounds = _most_rounds(
            (region(node, counter) for node in after),
            [each for each in changes if each is not None],
        )
        if rounds is not None:
            found.append((counter, rounds))
    return found


def _change_of(counter: Counter, moves: Moves) -> float | None:
    """The least change of a number on an edge, 0 if it may be any; None if it stays as it is."""
    index, name = counter
    return next((dict(move.counts).get(name) for i, move in moves if i == index), None)


def _most_rounds(regions: Iterable[Region | None], changes: Sequence[float]) -> int | None:
    """How often a number changes that never leaves its regions; None if nothing bounds that.

    Each change is by at least some amount; with changes up and down, or any, nothing does.
    """
    if not (min(changes) > 0 or max(changes) < 0):
        return None
    low, high = inf, -inf
    for region in regions:
        if region is None:
            return None
        low, high = min(low, region.low), max(high, region.high)
    least = min(map(abs, changes))
    rounds = (high - low) / least
    if rounds >= MOST_ROUNDS:
        return None
    if rounds * ulp(max(abs(low), abs(high))) > least:  # floats may round a change away
        return None
    is_whole = all(float(each).is_integer() for each in (low, high, *changes))
    return floor(rounds) + (not is_whole)  # one more, for what floats round
