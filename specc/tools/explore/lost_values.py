"""Values that are sent once and lost although their reader asks for them later.

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
class Lost:
    """An edge on which a value is lost: `overtaken` by the next one, or not looked at."""

    reader: int
    key: InputName
    number: int
    edge: Edge
    overtaken: bool


def lost_once(graph: Graph, abstraction: Abstraction) -> Iterator[Lost]:
    """The easiest loss of each input that is sent once and not declared an event.

    Inputs that differ only in the copy of an agent count as one.
    """
    composition = graph.composition
    if composition.widened:  # the graph does not follow all values
        return
    seen = set[Slot]()
    for reader, walker in enumerate(composition.walkers):
        for key in walker.inputs:
            if key in walker.events or (reader, key) in seen:
                continue
            orbit = composition.orbit((reader, key))
            seen.update(orbit)
            sent = _Sent(graph, [_Wire(composition, abstraction, slot) for slot in orbit])
            if sent.wires[0].is_once and sent.wires[0].asking:
                yield from sent.easiest_loss()


class _Wire:
    """An input with its sender."""

    def __init__(self, composition: Composition, abstraction: Abstraction, slot: Slot) -> None:
        self.reader, self.key = slot
        self._walkers = composition.walkers
        sent = abstraction.sender_of(composition.names[self.reader], self.key)
        assert sent is not None  # only such inputs are kept
        self.sender, self.output = composition.names.index(sent[0]), sent[1]
        answers = (abstraction.sender_of(sent[0], k) for k in self._walkers[self.sender].inputs)
        self.answers = {a[1] for a in answers if a and a[0] == composition.names[self.reader]}

    @property
    def is_once(self) -> bool:
        """Whether all behaviours that send it last one period, and some state does not send it."""
        states = self._walkers[self.sender].cone.states
        sending = [state for state in states if self.output in dict(state.assignments)]
        return len(sending) < len(states) and all(
            any(end.when == m.TRUE for end in state.endings) for state in sending
        )

    @cached_property
    def asking(self) -> set[str]:
        """The states that ask if it is fresh; none if one asks for the value alone, which stays."""
        cone = self._walkers[self.reader].cone
        asked = {state.name: cone.rests.all(state.conditions) for state in cone.states}
        found = {s for s, rests in asked.items() if self.key in rests.inputs}
        return found if all(self.key in asked[s].arrivals for s in found) else set()

    def acts(self, edge: Edge) -> bool:
        """Whether the reader takes a row to another state that sends the sender something."""
        moves = (move for i, move in edge.moves if i == self.reader)
        return any(
            move.source != move.target and not self.answers.isdisjoint(key for key, _ in move.sent)
            for move in moves
        )


_Node = tuple[int, int]
"""A configuration, and which of the wires is followed; edges that exchange copies change it."""


class _Sent:
    """An input that is sent once, for all copies that have it."""

    def __init__(self, graph: Graph, wires: Sequence[_Wire]) -> None:
        self.graph, self.wires = graph, wires
        self._composition = graph.composition
        self._numbers = {(wire.reader, wire.key): n for n, wire in enumerate(wires)}
        self._again: dict[int | None, dict[_Node, None]] = {}

    def easiest_loss(self) -> Iterator[Lost]:
        """The easiest edge, if any, on which it is lost for good and asked for later."""
        found = min(self._losses(), key=lambda x: self.graph.cost(x[0], x[1]), default=None)
        if found is not None:
            number, edge, wire, overtaken = found
            frame = self.graph.frame(number)
            key = self._composition.real(frame, wire.reader, wire.key, is_sent=False)
            yield Lost(frame[wire.reader], key, number, edge, overtaken)

    def _losses(self) -> Iterator[tuple[int, Edge, _Wire, bool]]:
        for number, out in enumerate(self.graph.edges):
            for edge in out:
                for before, after in self._followed(edge):
                    wire = self.wires[before]
                    overtaken = (wire.reader, wire.key) in edge.overtaken
                    passed = any(
                        i == wire.reader and wire.key in dict(x.lost) for i, x in edge.moves
                    )
                    if not (overtaken or passed):
                        continue
                    again = self._sent_again(self._in_buffer(number, wire) if overtaken else None)
                    there = edge.target, after
                    if there not in again and there in self._before_asking:
                        yield number, edge, wire, overtaken

    def _followed(self, edge: Edge) -> Iterator[tuple[int, int]]:
        """The number of each wire before an edge, and after it."""
        for after, wire in enumerate(self.wires):
            slot = self._composition.before(edge.turn, (wire.reader, wire.key))
            yield self._numbers[slot], after

    def _in_buffer(self, number: int, wire: _Wire) -> int:
        part = self._composition.parts_of(self.graph.configurations[number])[wire.reader]
        return part.buffers[self._composition.walkers[wire.reader].slots[wire.key]] // 2

    @cached_property
    def _before_asking(self) -> dict[_Node, None]:
        """The configurations from which the reader can reach a state that asks for it."""
        states = map(self._composition.states, self.graph.configurations)
        ends = [
            (number, n)
            for number, each in enumerate(states)
            for n, wire in enumerate(self.wires)
            if each[wire.reader] in wire.asking
        ]
        return self._before(ends, lambda *_: True)

    def _sent_again(self, value: int | None) -> dict[_Node, None]:
        """The configurations after which it may be sent before the reader has acted.

        With a `value`, only this value and unknown ones count.
        """
        if value not in self._again:
            beyond = range(len(self.graph.edges), len(self.graph.configurations))
            sending = {(number, n) for number in beyond for n in range(len(self.wires))}
            sending.update(self._sending(value))
            self._again[value] = self._before(
                sending, lambda edge, wire, there: there in sending or not wire.acts(edge)
            )
        return self._again[value]

    def _sending(self, value: int | None) -> Iterator[_Node]:
        """The configurations in which it was sent and is not visible yet."""
        known = self._composition.values.value
        for number, configuration in enumerate(self.graph.configurations):
            parts = self._composition.parts_of(configuration)
            for n, wire in enumerate(self.wires):
                sent = dict(parts[wire.sender].pending).get(wire.output)
                if sent is None:
                    continue
                any_counts = value is None or not all(is_known(known(x)) for x in (value, sent))
                if any_counts or sent == value:
                    yield number, n
        repeated = (
            (number, e) for number, out in enumerate(self.graph.edges) for e in out if e.loop
        )
        for number, edge in repeated:  # with values of which not all are in configurations
            for n, wire in enumerate(self.wires):
                if any(i == wire.sender and wire.output in dict(x.sent) for i, x in edge.moves):
                    yield number, n

    def _before(
        self, ends: Iterable[_Node], follows: Callable[[Edge, _Wire, _Node], bool]
    ) -> dict[_Node, None]:
        """The configurations that reach some others by edges that `follows` accepts."""
        edges = (
            (edge, (number, before), (edge.target, after))
            for number, out in enumerate(self.graph.edges)
            for edge in out
            for before, after in self._followed(edge)
        )
        sources = grouped(
            (there, here)
            for edge, here, there in edges
            if follows(edge, self.wires[here[1]], there)
        )
        return reachable(ends, lambda node: sources.get(node, ()))
