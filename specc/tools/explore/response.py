"""Bounded response: requests that can no longer be answered, unless they are made anew.

`always(p implies within(d, q))` requests an answer `q` where `p` holds. While it is pending, a run
answers it on a way on which `p` lasts, then does not hold, until `q` holds. A configuration without
such a way is a dead end if a run may stay unanswered for longer than the deadline from there on.
The graph has every run and more, so it lacks no way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from heapq import heapify, heappop, heappush
from math import inf
from typing import Literal

from specc.model import requirement as r
from specc.reachable import grouped, reachable
from specc.tools.explore.composition import Edge
from specc.tools.explore.graph import Graph, after
from specc.tools.explore.monitor import TruthValue


@dataclass(frozen=True, slots=True)
class Response:
    """An `answer` within a deadline after each tick at which all of the `request` holds."""

    answer: r.TemporalFormula
    deadline_s: Fraction
    request: tuple[r.TemporalFormula, ...] = ()

    @property
    def at_once(self) -> r.TemporalFormula:
        """That the answer is there at the tick of the request."""
        return r.Junction("or", (_not(self.asked), self.answer))

    @property
    def asked(self) -> r.TemporalFormula:
        """The request as one formula."""
        return r.Junction("and", self.request)


def responses(formula: r.TemporalFormula, *, meant: bool = True) -> Iterator[Response]:
    """The responses that a formula, or its negation, asks for, each part of a conjunction alone."""
    match formula:
        case r.Junction(op="not", operands=(operand,)):
            yield from responses(operand, meant=not meant)
        case r.Junction(op=op, operands=operands) if (op == "and") == meant:
            for operand in operands:
                yield from responses(operand, meant=meant)
        case r.Junction(operands=operands):
            ahead = [each for each in operands if not r.is_timeless(each)]
            now = [_not(each) if meant else each for each in operands if r.is_timeless(each)]
            for part in responses(ahead[0], meant=meant) if len(ahead) == 1 else ():
                yield replace(part, request=(*now, *part.request))
        case r.Temporal(op="within" | "throughout" as op, operands=(operand,)):
            if (op == "within") == meant and r.is_timeless(operand):
                yield Response(operand if meant else _not(operand), formula.span_s)


def _not(formula: r.TemporalFormula) -> r.TemporalFormula:
    return r.Junction("not", (formula,))


Phase = Literal["asked", "over", "ever"]
"""What is left of a request: it holds, it is over, or it may be made anew at any time."""
PendingPlace = tuple[int, Phase]
"""A configuration with a pending answer."""


@dataclass(frozen=True, slots=True)
class DeadEnd:
    """A pending answer that cannot come: the configuration with the request, and the way on."""

    start: int
    way: tuple[Edge, ...]
    unless_anew: bool
    """Whether a request that is made anew may be answered."""


class Pending:
    """The places of a graph where an answer is pending.

    It may hold or not where it is unknown whether a request holds. An unknown answer is one.
    """

    def __init__(
        self,
        graph: Graph,
        asked: Sequence[TruthValue],
        answered: Sequence[TruthValue],
        deadline_s: Fraction,
    ) -> None:
        """`asked` and `answered` are the truth values in each configuration."""
        self._graph, self._asked, self._answered = graph, asked, answered
        self._deadline = deadline_s / graph.composition.tick_s

    def dead_end(self, starts: Iterable[int]) -> DeadEnd | None:
        """The dead end with the easiest way, for requests in some configurations."""
        begins: list[PendingPlace] = [(n, self._phase(n)) for n in starts]
        places = reachable(begins, lambda place: [there for there, _ in self._pending(place)])
        until_anew = self._dead(places)
        for_ever = self._dead((number, "ever") for number, _ in places)
        costs = {place: self._graph.cost(place[0]) for place in begins}
        before = dict[PendingPlace, tuple[PendingPlace, Edge]]()
        waiting = [(cost, place) for place, cost in costs.items()]
        heapify(waiting)
        while waiting:
            cost, place = heappop(waiting)
            is_shut = (place[0], "ever") in for_ever
            if is_shut or place in until_anew:
                way = list[Edge]()
                while place in before:
                    place, edge = before[place]
                    way.insert(0, edge)
                return DeadEnd(place[0], tuple(way), not is_shut)
            for there, edge in self._pending(place):
                if there not in costs or after(cost, edge) < costs[there]:
                    costs[there], before[there] = after(cost, edge), (place, edge)
                    heappush(waiting, (costs[there], there))
        return None

    def _phase(self, number: int) -> Phase:
        return "over" if self._asked[number] is False else "asked"

    def _pending(self, place: PendingPlace) -> Iterator[tuple[PendingPlace, Edge]]:
        """Where the answer is still pending after a step; the request may be made anew."""
        for edge in self._edges(place[0]):
            if self._answered[edge.target] is False and len(edge.loop) < 2:
                yield (edge.target, self._phase(edge.target)), edge

    def _edges(self, number: int) -> list[Edge]:
        return self._graph.going_on(number) if number < len(self._graph.edges) else []

    def _following(self, place: PendingPlace) -> Iterator[PendingPlace | None]:
        """The places after a step on which no request is made anew; None for an answer."""
        number, phase = place
        if number >= len(self._graph.edges):  # nothing is known of what follows
            yield None
        for edge in self._edges(number):
            yield from self._after(phase, edge)

    def _after(self, phase: Phase, edge: Edge) -> Iterator[PendingPlace | None]:
        there = edge.target
        asked = self._asked[there]
        if phase == "over" and asked is True:
            return  # what answers now answers the request that is made anew
        if self._answered[there] is not False or len(edge.loop) > 1:
            yield None  # within several repeated steps there may be one
        elif phase == "ever":
            yield there, "ever"
        else:
            if asked is not False and phase == "asked":
                yield there, "asked"
            if asked is not True:
                yield there, "over"

    def _dead(self, places: Iterable[PendingPlace]) -> set[PendingPlace]:
        """The places from which no answer comes, although a run may last beyond the deadline."""
        known = reachable(places, lambda place: filter(None, self._following(place)))
        pairs = [(there, here) for here in known for there in self._following(here)]
        before = grouped(pairs)
        answered = reachable([None], lambda place: before.get(place, ()))
        shut = {place for place in known if place not in answered}
        longest = self._longest(shut, before)
        return {place for place in shut if longest.get(place, inf) > self._deadline}

    def _longest(
        self, shut: set[PendingPlace], before: Mapping[PendingPlace | None, Sequence[PendingPlace]]
    ) -> dict[PendingPlace, int]:
        """For how many ticks runs stay in these places; without those where they may for ever."""
        left = {place: sum(1 for _ in self._following(place)) for place in shut}
        found, waiting = (
            dict[PendingPlace, int](),
            [place for place, count in left.items() if not count],
        )
        while waiting:
            place = waiting.pop()
            number, phase = place
            found[place] = max(
                (
                    self._graph.passed(number, edge)
                    + max((found[p] for p in self._after(phase, edge) if p), default=0)
                    for edge in self._edges(number)
                ),
                default=0,
            )
            for earlier in before.get(place, ()):
                if earlier in shut:
                    left[earlier] -= 1
                    waiting += [] if left[earlier] else [earlier]
        return found
