"""How old values are where they are read: the time since the measurements behind them.

A value is as old as the oldest measurement that it is computed from, through subsystems that read
and send within one work cycle. Memory, and a loop through several subsystems, are not followed.
"""

from __future__ import annotations

from fractions import Fraction
from graphlib import CycleError, TopologicalSorter
from typing import NamedTuple

from specc.facts.facts import Facts
from specc.facts.graph import components
from specc.facts.sources import Measured, Node, Sent, Sources
from specc.facts.trails import Edges, Timeline, Trail


class Held(NamedTuple):
    """A value that is read although its source may have been silent since any length of time."""

    node: Node
    source: Sent | Measured


class Ages:
    """Ages of the values in the input buffers of a system."""

    def __init__(self, facts: Facts) -> None:
        self.sources = Sources(facts)
        self._facts = facts
        self._oldest: dict[Node, Trail | Held | None] = {}
        self._periods = {s.qualified_name: 1 / s.rate_hz for s in facts.subsystems}

    def oldest(self, node: Node) -> Trail | Held | None:
        """The oldest value that is read, or why there is none; None if no measurement is known.

        A device takes a value when it is sent; a subsystem that uses one only where it is fresh
        is not asked for its age later.
        """
        if node not in self._oldest:
            self._oldest[node] = self._follow(node)
        return self._oldest[node]

    def only_on_arrival(self, node: Node) -> bool:
        """Whether a subsystem uses a value only where it is fresh."""
        reader = self._facts.connections.subsystems.get(node.reader)
        if reader is None:
            return False
        own = [read for read in self.sources.own_reads(reader) if read.input == node[1:]]
        return bool(own) and all(read.on_arrival for read in own)

    def _follow(self, node: Node) -> Trail | Held | None:
        edges = self._upstream(node)
        order = self._order(edges)
        measured = _behind(order, edges, self.sources)
        if node not in measured:
            return None
        edges = {n: tuple(e for e in edges[n] if e[0] in measured) for n in order if n in measured}
        order = [n for n in order if n in measured]
        on_arrival = not node.peer or self.only_on_arrival(node)
        held = self._held(order, edges, node, on_arrival)
        if held is not None:
            return held
        periods_s = {n: self._period_s(n) for n in order}
        return Timeline(self.sources, order, edges, periods_s).oldest(node, on_arrival)

    def _period_s(self, node: Node) -> Fraction:
        """Between two time stamps of a reader; a device reads whenever something is sent."""
        if node.peer:
            return self._periods[node.reader]
        sent = self.sources.of(node)
        assert isinstance(sent, Sent)
        return self._periods[sent.sender.qualified_name]

    def _upstream(self, node: Node) -> Edges:
        edges: Edges = {}
        open_ = [node]
        while open_:
            here = open_.pop()
            if here not in edges:
                source = self.sources.of(here)
                edges[here] = source.reads if isinstance(source, Sent) else ()
                open_ += [n for n, _ in edges[here]]
        return edges

    def _order(self, edges: Edges) -> list[Node]:
        """Every node behind those that it is computed from; what makes a loop is taken out."""
        try:
            return list(TopologicalSorter(_targets(edges)).static_order())
        except CycleError:
            names = {str(n): n for n in edges}
            pairs = [(str(n), str(m)) for n, reads in edges.items() for m, _ in reads]
            part = {
                names[name]: number
                for number, found in enumerate(components(list(names), pairs))
                for name in found.states
            }
            for n, reads in edges.items():
                edges[n] = tuple(e for e in reads if part[e[0]] != part[n])
            return list(TopologicalSorter(_targets(edges)).static_order())

    def _held(self, order: list[Node], edges: Edges, node: Node, on_arrival: bool) -> Held | None:
        """The first value on the way to `node` that no arrival bounds in age."""
        held = {node} if not on_arrival else set()
        held |= {n for reads in edges.values() for n, arrival in reads if not arrival}
        for n in order:
            source = self.sources.of(n)
            if n in held and source is not None and _may_be_silent(source):
                return Held(n, source)
        return None


def _may_be_silent(source: Sent | Measured) -> bool:
    return source.unlimited if isinstance(source, Measured) else source.silent is not None


def _targets(edges: Edges) -> dict[Node, list[Node]]:
    return {n: [m for m, _ in reads] for n, reads in edges.items()}


def _behind(order: list[Node], edges: Edges, sources: Sources) -> set[Node]:
    """Nodes with a measurement behind them."""
    found: set[Node] = set()
    for n in order:
        if isinstance(sources.of(n), Measured) or any(m in found for m, _ in edges[n]):
            found.add(n)
    return found
