"""Values that are sent once and lost although their reader tests for them later.

An output is sent once if only behaviours of one period send it, and if it is not sent again before
the reader has acted. The reader acts when it takes a row to another state in which it sends
something back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from specc.model import expr as m
from specc.proof import InputName
from specc.reachable import grouped, reachable
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Edge, Slot
from specc.tools.explore.graph import Graph
from specc.tools.explore.partial import is_known


@dataclass(frozen=True, slots=True)
class LostValue:
    """An edge on which a value is lost: overwritten by the next one, or not read."""

    reader: int
    key: InputName
    number: int
    edge: Edge
    is_overwritten: bool


def lost_once(graph: Graph, abstraction: Abstraction) -> Iterator[LostValue]:
    """The easiest loss of each input that is sent once and not declared an event.

    Inputs that differ only in the copy of an agent count as one.
    """
    composition = graph.composition
    if composition.widened:  # the graph does not track all values
        return
    seen = set[Slot]()
    for reader, walker in enumerate(composition.walkers):
        for key in walker.inputs:
            if key in walker.events or (reader, key) in seen:
                continue
            orbit = composition.orbit((reader, key))
            seen.update(orbit)
            sent = _SentOnce(graph, [_Connection(composition, abstraction, slot) for slot in orbit])
            if sent.connections[0].is_sent_once and sent.connections[0].asking_states:
                yield from sent.easiest_loss()


class _Connection:
    """An input with its sender."""

    def __init__(self, composition: Composition, abstraction: Abstraction, slot: Slot) -> None:
        self.reader, self.key = slot
        self._walkers = composition.walkers
        sent = abstraction.sender_of(composition.names[self.reader], self.key)
        assert sent is not None  # only such inputs are tracked
        self.sender, self.output = composition.names.index(sent[0]), sent[1]
        answers = (abstraction.sender_of(sent[0], k) for k in self._walkers[self.sender].inputs)
        self.answers = {a[1] for a in answers if a and a[0] == composition.names[self.reader]}

    @property
    def is_sent_once(self) -> bool:
        """Whether all behaviours that send it last one period, and some state does not send it."""
        states = self._walkers[self.sender].cone.states
        sending = [state for state in states if self.output in dict(state.assignments)]
        return len(sending) < len(states) and all(
            any(end.when == m.TRUE for end in state.endings) for state in sending
        )

    @cached_property
    def asking_states(self) -> set[str]:
        """The states that test if it is fresh; none if one reads the value alone."""
        cone = self._walkers[self.reader].cone
        dependences = {state.name: cone.dependences.all(state.conditions) for state in cone.states}
        found = {s for s, rests in dependences.items() if self.key in rests.inputs}
        return found if all(self.key in dependences[s].arrivals for s in found) else set()

    def acts(self, edge: Edge) -> bool:
        """Whether the reader takes a row to another state that sends the sender something."""
        moves = (move for i, move in edge.transitions if i == self.reader)
        return any(
            move.source != move.target and not self.answers.isdisjoint(key for key, _ in move.sent)
            for move in moves
        )


_Node = tuple[int, int]
"""A configuration and the index of a connection, which edges that exchange copies change."""


class _SentOnce:
    """An input that is sent once, for all copies that have it."""

    def __init__(self, graph: Graph, wires: Sequence[_Connection]) -> None:
        self.graph, self.connections = graph, wires
        self._composition = graph.composition
        self._numbers = {(wire.reader, wire.key): n for n, wire in enumerate(wires)}
        self._resent_cache: dict[int | None, dict[_Node, None]] = {}

    def easiest_loss(self) -> Iterator[LostValue]:
        """The easiest edge, if any, on which it is lost for good and tested for later."""
        found = min(self._losses(), key=lambda x: self.graph.cost(x[0], x[1]), default=None)
        if found is not None:
            number, edge, wire, overwritten = found
            frame = self.graph.frame(number)
            key = self._composition.real_name(frame, wire.reader, wire.key, is_sent=False)
            yield LostValue(frame[wire.reader], key, number, edge, overwritten)

    def _losses(self) -> Iterator[tuple[int, Edge, _Connection, bool]]:
        """Yields each edge on which the value is lost for good.

        With it come its configuration, the connection, and whether the value is overwritten.
        """
        for number, outgoing_edges in enumerate(self.graph.edges):
            for edge in outgoing_edges:
                for before, after in self._connections_across(edge):
                    connection = self.connections[before]
                    overwritten = (connection.reader, connection.key) in edge.overwritten
                    was_missed = any(
                        i == connection.reader and connection.key in dict(x.lost)
                        for i, x in edge.transitions
                    )
                    if not (overwritten or was_missed):
                        continue
                    resent = self._resent_from(
                        self._buffered_value(number, connection) if overwritten else None
                    )
                    target = edge.target, after
                    if target not in resent and target in self._reaching_query:
                        yield number, edge, connection, overwritten

    def _connections_across(self, edge: Edge) -> Iterator[tuple[int, int]]:
        """The number of each wire before an edge, and after it."""
        for after, wire in enumerate(self.connections):
            slot = self._composition.slot_before(edge.permutation, (wire.reader, wire.key))
            yield self._numbers[slot], after

    def _buffered_value(self, number: int, wire: _Connection) -> int:
        part = self._composition.parts_of(self.graph.configurations[number])[wire.reader]
        return part.buffers[self._composition.walkers[wire.reader].slots[wire.key]] // 2

    @cached_property
    def _reaching_query(self) -> dict[_Node, None]:
        """The configurations from which the reader can reach a state that tests for it."""
        states = map(self._composition.state_names, self.graph.configurations)
        ends = [
            (number, n)
            for number, each in enumerate(states)
            for n, wire in enumerate(self.connections)
            if each[wire.reader] in wire.asking_states
        ]
        return self._reaching(ends, lambda *_: True)

    def _resent_from(self, value: int | None) -> dict[_Node, None]:
        """The configurations after which it may be sent before the reader has acted.

        With a `value`, only this value and unknown ones count.
        """
        if value not in self._resent_cache:
            beyond = range(len(self.graph.edges), len(self.graph.configurations))
            sending = {(number, n) for number in beyond for n in range(len(self.connections))}
            sending.update(self._in_transit(value))
            self._resent_cache[value] = self._reaching(
                sending, lambda edge, wire, target: target in sending or not wire.acts(edge)
            )
        return self._resent_cache[value]

    def _in_transit(self, value: int | None) -> Iterator[_Node]:
        """The configurations in which it was sent and is not visible yet."""
        known = self._composition.values.value
        for number, configuration in enumerate(self.graph.configurations):
            parts = self._composition.parts_of(configuration)
            for n, wire in enumerate(self.connections):
                sent = dict(parts[wire.sender].pending).get(wire.output)
                if sent is None:
                    continue
                any_counts = value is None or not all(is_known(known(x)) for x in (value, sent))
                if any_counts or sent == value:
                    yield number, n

    def _reaching(
        self, ends: Iterable[_Node], follows: Callable[[Edge, _Connection, _Node], bool]
    ) -> dict[_Node, None]:
        """The configurations that reach some others by edges that `follows` accepts."""
        edges = (
            (edge, (number, before), (edge.target, after))
            for number, out in enumerate(self.graph.edges)
            for edge in out
            for before, after in self._connections_across(edge)
        )
        sources = grouped(
            (target, here)
            for edge, here, target in edges
            if follows(edge, self.connections[here[1]], target)
        )
        return reachable(ends, lambda node: sources.get(node, ()))
