"""How long runs may stay in a part of a graph, with counters as ranking functions.

On a cycle of the graph a run may stay for ever, unless a counter ends it. Of a number that counts
only the region is known. But while a run goes round a cycle on which such a number only grows, by
at least some amount at some edges, the ends of the region bound how often it takes these edges.
What is left without them is bounded in the same way, by another counter or since it has no cycle.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from itertools import product
from math import floor, inf, ulp
from typing import Generic, TypeVar

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
    return _Stays({node: following(node) for node in reached}, ticks, region).by_node


class _Stays(Generic[Node]):
    """The longest stays in the nodes of a graph."""

    def __init__(
        self,
        after: Mapping[Node, Edges[Node]],
        ticks: Callable[[Node], int],
        region: Callable[[Node, Counter], Region | None] | None,
    ) -> None:
        self._after, self._ticks, self._region = after, ticks, region
        self.by_node: dict[Node, int] = {}
        self._follow_paths_backwards()
        self._cyclic = [node for node in after if node not in self.by_node]
        best: dict[Node, int] = {}
        if self._region is None:
            return
        for found in (each for one in self._counters() for each in self._contractions(one)):
            best = max(best, found, key=lambda stays: len(stays))
            if len(best) == len(self._cyclic):
                break
        self.by_node |= best

    def _follow_paths_backwards(self) -> None:
        """Find the stays in nodes from which no cycle is reached."""
        after, stays = self._after, self.by_node
        before = grouped((target, here) for here, out in after.items() for target, _ in out)
        remaining = {node: len(out) for node, out in after.items()}
        waiting = [node for node, count in remaining.items() if not count]
        while waiting:
            node = waiting.pop()
            longest = max((stays[target] for target, _ in after[node]), default=0)
            stays[node] = self._ticks(node) + longest
            for earlier in before.get(node, ()):
                remaining[earlier] -= 1
                waiting += [] if remaining[earlier] else [earlier]

    def _counters(self) -> Iterable[Counter]:
        moves = (move for n in self._cyclic for _, moves in self._after[n] for move in moves)
        return dict.fromkeys((i, name) for i, move in moves for name, by in move.counts if by)

    def _contractions(self, counter: Counter) -> Iterator[dict[Node, int]]:
        """The stays with a zone as one node: nodes between which a number only grows, or shrinks.

        What leads from the zone back to it by any other step is a loop of that node.
        """
        assert self._region is not None
        regions = {node: self._region(node, counter) for node in self._cyclic}
        for region, sign in product(dict.fromkeys(filter(None, regions.values())), (1, -1)):
            inside: dict[Node, Edges[Node]] = {}
            for node in (each for each in self._cyclic if regions[each] == region):
                changes = [(_change_of(counter, edge[1]), edge) for edge in self._after[node]]
                inside[node] = [
                    edge
                    for by, edge in changes
                    if regions.get(edge[0]) == region and (by is None or by * sign > 0)
                ]
            for part in _connected(inside):
                zone = {node: inside[node] for node in part}
                stay = self._stay_in(zone, counter, region)
                if stay is not None:
                    yield self._contracted(zone, stay)

    def _stay_in(
        self, zone: Mapping[Node, Edges[Node]], counter: Counter, region: Region
    ) -> int | None:
        """For how many ticks a run stays in a zone; None if it may stay for ever."""
        changes = [_change_of(counter, moves) for out in zone.values() for _, moves in out]
        rounds = _most_rounds(region, list(filter(None, changes)))
        if rounds is None:
            return None
        rest = {
            node: [(to, moves) for to, moves in out if not _change_of(counter, moves)]
            for node, out in zone.items()
        }
        stays = _Stays(rest, self._ticks, self._region).by_node
        return (rounds + 1) * max(stays.values()) if len(stays) == len(zone) else None

    def _contracted(self, zone: Mapping[Node, Edges[Node]], stay: int) -> dict[Node, int]:
        assert self._region is not None
        whole, known = next(iter(zone)), self._region
        inside = [moves for out in zone.values() for _, moves in out]

        def region(node: Node, counter: Counter) -> Region | None:
            # What changes inside a zone may end up anywhere when a run leaves it.
            if node == whole and any(_change_of(counter, moves) is not None for moves in inside):
                return None
            found = known(node, counter)
            same = node != whole or all(known(each, counter) == found for each in zone)
            return found if same else None

        place = {node: whole if node in zone else node for node in self._cyclic}
        lasts = {whole: stay, **self.by_node}
        after: dict[Node, list[tuple[Node, Moves]]] = {node: [] for node in self.by_node}
        for node in self._cyclic:
            inner = zone.get(node, ())
            leaving = (each for each in self._after[node] if all(each is not one for one in inner))
            out = [(place.get(to, to), moves) for to, moves in leaving]
            after.setdefault(place[node], []).extend(out)
        stays = _Stays(after, lambda n: lasts[n] if n in lasts else self._ticks(n), region).by_node
        return {node: stays[place[node]] for node in self._cyclic if place[node] in stays}


def _connected(edges: Mapping[Node, Edges[Node]]) -> Iterator[list[Node]]:
    """The parts of a graph that edges connect, whatever their direction."""
    both: dict[Node, list[Node]] = {node: [to for to, _ in out] for node, out in edges.items()}
    for node, out in edges.items():
        for to, _ in out:
            both[to].append(node)
    seen = set[Node]()
    for node in edges:
        if node not in seen:
            part = reachable([node], both.__getitem__)
            seen |= part.keys()
            yield list(part)


def _change_of(counter: Counter, moves: Moves) -> float | None:
    """The least change of a number on an edge, 0 if it may be any; None if it stays as it is."""
    index, name = counter
    return next((dict(move.counts).get(name) for i, move in moves if i == index), None)


def _most_rounds(region: Region, changes: Sequence[float]) -> int | None:
    """How often a number changes within its region, which it does by at least some amount."""
    least = min(map(abs, changes), default=0.0)
    rounds = (region.high - region.low) / least if least else inf
    if rounds >= MOST_ROUNDS:
        return None
    if rounds * ulp(max(map(abs, region))) > least:  # floats may round a change away
        return None
    is_whole = all(float(each).is_integer() for each in (*region, *changes))
    return floor(rounds) + (not is_whole)  # one more, for what floats round
