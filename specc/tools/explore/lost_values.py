"""Values that are sent once and lost although their reader asks for them later.

An output is sent once if only behaviours of one period send it, and if it is not sent again before
the reader has acted. The reader acts when it takes a row to another state in which it sends
something back.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property

from specc.frozen import frozen
from specc.model import expr as m
from specc.proof import InputName
from specc.reachable import grouped, reachable
from specc.tools.explore.abstraction import Abstraction, conditions_of
from specc.tools.explore.composition import Edge
from specc.tools.explore.graph import Graph
from specc.tools.explore.partial import is_known


@frozen
class Lost:
    """An edge on which a value is lost: `overtaken` by the next one, or not looked at."""

    reader: int
    key: InputName
    number: int
    edge: Edge
    overtaken: bool


def lost_once(graph: Graph, abstraction: Abstraction) -> Iterator[Lost]:
    """The easiest loss of each input that is sent once and not declared an event."""
    composition = graph.composition
    # A path on which copies were exchanged does not tell which copy sends again; nor does a graph
    # in which not all values are followed.
    if composition.copies or composition.widened:
        return
    for reader, walker in enumerate(composition.walkers):
        for key in walker.inputs:
            sent = _Sent(graph, abstraction, reader, key)
            found = None
            if key not in walker.events and sent.is_once and sent.asking:
                found = min(sent.losses(), key=lambda x: graph.cost(x.number, x.edge), default=None)
            if found is not None:
                yield found


class _Sent:
    """An input that is sent once."""

    def __init__(self, graph: Graph, abstraction: Abstraction, reader: int, key: InputName):
        self.graph, self.reader, self.key = graph, reader, key
        self._composition = composition = graph.composition
        sent = abstraction.sender_of(composition.names[reader], key)
        assert sent is not None  # only such inputs are kept
        self._sender, self._output = composition.names.index(sent[0]), sent[1]
        answers = (
            abstraction.sender_of(sent[0], k) for k in composition.walkers[self._sender].inputs
        )
        self._answers = {a[1] for a in answers if a and a[0] == composition.names[reader]}
        self._again: dict[int | None, dict[int, None]] = {}

    @property
    def is_once(self) -> bool:
        """Whether all behaviours that send it last one period, and some state does not send it."""
        sender = self._composition.walkers[self._sender].subsystem
        names = sender.written.get(self._output, {}).keys()
        sending = [state for state in sender.states if state.behaviour.name in names]
        return len(sending) < len(sender.states) and all(
            any(end.when == m.TRUE for _, end in state.behaviour.endings) for state in sending
        )

    def losses(self) -> Iterator[Lost]:
        """The edges on which it is lost for good, if the reader asks for it later."""
        for number, out in enumerate(self.graph.edges):
            for edge in out:
                overtaken = (self.reader, self.key) in edge.overtaken
                passed = any(i == self.reader and self.key in move.lost for i, move in edge.moves)
                if not (overtaken or passed):
                    continue
                again = self._sent_again(self._in_buffer(number) if overtaken else None)
                if edge.target not in again and edge.target in self._before_asking:
                    yield Lost(self.reader, self.key, number, edge, overtaken)

    def _in_buffer(self, number: int) -> int:
        part = self._composition.parts_of(self.graph.configurations[number])[self.reader]
        return part.buffers[self._composition.walkers[self.reader].slots[self.key]] // 2

    @cached_property
    def asking(self) -> set[str]:
        """The states that ask if it is fresh; none if one asks for the value alone, which stays."""
        kept = self._composition.walkers[self.reader].kept
        names = [state.name for state in kept.subsystem.states]
        asked = {s: kept.rests.all(conditions_of(kept.subsystem, s)) for s in names}
        found = {s for s, rests in asked.items() if self.key in rests.inputs}
        return found if all(self.key in asked[s].arrivals for s in found) else set()

    @cached_property
    def _before_asking(self) -> dict[int, None]:
        """The configurations from which the reader can reach a state that asks for it."""
        states = map(self._composition.states, self.graph.configurations)
        ends = (number for number, each in enumerate(states) if each[self.reader] in self.asking)
        return self._before(ends, lambda _: True)

    def _sent_again(self, value: int | None) -> dict[int, None]:
        """The configurations after which it may be sent before the reader has acted.

        With a `value`, only this value and unknown ones count.
        """
        if value not in self._again:
            beyond = range(len(self.graph.edges), len(self.graph.configurations))
            sending = {*beyond, *self._sending(value)}
            self._again[value] = self._before(
                sending, lambda edge: edge.target in sending or not self._acts(edge)
            )
        return self._again[value]

    def _sending(self, value: int | None) -> Iterator[int]:
        """The configurations in which it was sent and is not visible yet."""
        known = self._composition.values.value
        for number, configuration in enumerate(self.graph.configurations):
            pending = dict(self._composition.parts_of(configuration)[self._sender].pending)
            sent = pending.get(self._output)
            any_counts = value is None or not all(is_known(known(n)) for n in (value, sent or 0))
            if sent is not None and (any_counts or sent == value):
                yield number
        repeated = (
            (number, e) for number, out in enumerate(self.graph.edges) for e in out if e.loop
        )
        for number, edge in repeated:  # with values of which not all are in configurations
            if any(i == self._sender and self._output in dict(move.sent) for i, move in edge.moves):
                yield number

    def _acts(self, edge: Edge) -> bool:
        """Whether the reader takes a row to another state that sends the sender something."""
        moves = (move for i, move in edge.moves if i == self.reader)
        return any(
            move.source != move.target and not self._answers.isdisjoint(key for key, _ in move.sent)
            for move in moves
        )

    def _before(self, ends: Iterable[int], follows: Callable[[Edge], bool]) -> dict[int, None]:
        """The configurations that reach some others by edges that `follows` accepts."""
        edges = ((edge, n) for n, out in enumerate(self.graph.edges) for edge in out)
        before = grouped((edge.target, n) for edge, n in edges if follows(edge))
        return reachable(ends, lambda number: before.get(number, ()))
