"""How long runs may stay in a part of a graph, with counters as ranking functions.

In a strongly connected part of a graph a run may stay for ever, unless a counter ends it. Of a
number that counts only regions are known. But while a run stays in a part in which such a number
only grows, by at least some amount at some edges, the ends of its regions bound how often the run
takes these edges. What is left without them is bounded in the same way, by another counter or
since it has no cycle: together the counters are a lexicographic ranking function.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from math import floor, ulp
from typing import TypeVar

from specc.analysis.graph import components
from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import range_of
from specc.lang.ranges import ANY, Range, negative, union
from specc.model import expr as m
from specc.reachable import reachable
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
Edge = tuple[Node, Node, Moves]
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
    reached = reachable(nodes, lambda node: [target for target, _ in following(node)])
    edges = [(node, target, moves) for node in reached for target, moves in following(node)]
    return _stays(list(reached), edges, ticks, region)


def _stays(
    nodes: Sequence[Node],
    edges: Sequence[Edge[Node]],
    ticks: Callable[[Node], int],
    region: Callable[[Node, Counter], Region | None] | None,
) -> dict[Node, int]:
    """The longest stays in the nodes of a graph, where runs leave each of its cycles."""
    parts = components(nodes, [(here, target) for here, target, _ in edges])
    part_of = {node: number for number, part in enumerate(parts) for node in part.states}
    inside: list[list[Edge[Node]]] = [[] for _ in parts]
    after: list[set[int]] = [set() for _ in parts]
    for edge in edges:
        here, target = part_of[edge[0]], part_of[edge[1]]
        if here == target:
            inside[here].append(edge)
        else:
            after[here].add(target)
    stays: dict[int, int] = {}
    for number in reversed(range(len(parts))):  # each part after those that it leads to
        if after[number] <= stays.keys():
            stay = _stay_within(parts[number].states, inside[number], ticks, region)
            if stay is not None:
                stays[number] = stay + max((stays[each] for each in after[number]), default=0)
    return {node: stays[number] for node, number in part_of.items() if number in stays}


def _stay_within(
    nodes: Sequence[Node],
    edges: Sequence[Edge[Node]],
    ticks: Callable[[Node], int],
    region: Callable[[Node, Counter], Region | None] | None,
) -> int | None:
    """For how many ticks a run stays in strongly connected nodes; None if it may stay for ever."""
    if not edges:
        return sum(map(ticks, nodes))
    if region is None:
        return None
    counters = {(i, name) for _, _, moves in edges for i, move in moves for name, _ in move.counts}
    bounds = []
    for counter in counters:
        regions = [region(node, counter) for node in nodes]
        changes = [_change_of(counter, moves) for _, _, moves in edges]
        rounds = _most_rounds(regions, [each for each in changes if each is not None])
        if rounds is not None:
            bounds.append((rounds, counter))
    if not bounds:
        return None
    rounds, counter = min(bounds)  # any other one still bounds what is left
    rest = [edge for edge in edges if not _change_of(counter, edge[2])]
    stays = _stays(nodes, rest, ticks, region)
    return (rounds + 1) * max(stays.values()) if len(stays) == len(nodes) else None


def _change_of(counter: Counter, moves: Moves) -> float | None:
    """The least change of a number on an edge, 0 if it may be any; None if it stays as it is."""
    index, name = counter
    return next((dict(move.counts).get(name) for i, move in moves if i == index), None)


def _most_rounds(regions: Sequence[Region | None], changes: Sequence[float]) -> int | None:
    """How often a number changes that never leaves its regions; None if nothing bounds that.

    Each change is by at least some amount; with changes up and down, or any, nothing does.
    """
    known = [region for region in regions if region is not None]
    if len(known) < len(regions) or not (min(changes) > 0 or max(changes) < 0):
        return None
    low, high = min(each.low for each in known), max(each.high for each in known)
    least = min(map(abs, changes))
    rounds = (high - low) / least
    if rounds >= MOST_ROUNDS:
        return None
    if rounds * ulp(max(abs(low), abs(high))) > least:  # floats may round a change away
        return None
    is_whole = all(float(each).is_integer() for each in (low, high, *changes))
    return floor(rounds) + (not is_whole)  # one more, for what floats round
