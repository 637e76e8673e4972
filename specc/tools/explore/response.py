"""Bounded response: requests that can no longer be answered, unless they are repeated.

`always(p implies within(d, q))` requests an answer `q` where `p` holds. While it is pending, a run
answers it on a way on which `p` lasts, then does not hold, until `q` holds. A configuration without
such a way is a dead end if a run may stay unanswered for longer than the deadline from there on.
The graph has every run and more, so it lacks no way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from heapq import heapify, heappop, heappush
from math import inf
from typing import Literal

from specc.model import requirement as r
from specc.reachable import grouped, reachable
from specc.tools.explore.composition import Edge
from specc.tools.explore.graph import Graph, extended_cost
from specc.tools.explore.monitor import TruthValue
from specc.tools.explore.ranking import Moves, longest_stays


@dataclass(frozen=True, slots=True)
class Response:
    """An `answer` within a deadline after each tick at which all of the `request` holds."""

    answer: r.TemporalFormula
    deadline_s: Fraction
    request: tuple[r.TemporalFormula, ...] = ()

    @property
    def antecedent(self) -> r.TemporalFormula:
        """The request as one formula."""
        return r.BoolOp("and", self.request)


def responses(formula: r.TemporalFormula, *, positive: bool = True) -> Iterator[Response | None]:
    """The responses that a formula, or its negation, requires, one for each conjunct.

    A conjunct about single ticks is a response without a deadline; None is one of another shape.
    """
    if r.is_timeless(formula):
        yield Response(formula if positive else _negation(formula), Fraction(0))
        return
    match formula:
        case r.BoolOp(op="not", operands=(operand,)):
            yield from responses(operand, positive=not positive)
        case r.BoolOp(op=op, operands=operands) if (op == "and") == positive:
            for operand in operands:
                yield from responses(operand, positive=positive)
        case r.BoolOp(operands=operands):
            ahead = [each for each in operands if not r.is_timeless(each)]
            now = [
                _negation(each) if positive else each for each in operands if r.is_timeless(each)
            ]
            for part in responses(ahead[0], positive=positive) if len(ahead) == 1 else (None,):
                yield part and replace(part, request=(*now, *part.request))
        case r.Temporal(op="within" | "throughout" as op, operands=(operand,)) if (
            op == "within"
        ) == positive and r.is_timeless(operand):
            yield Response(operand if positive else _negation(operand), formula.span_s)
        case _:
            yield None


def _negation(formula: r.TemporalFormula) -> r.TemporalFormula:
    return r.BoolOp("not", (formula,))


Phase = Literal["asked", "over", "ever"]
"""The phase of a request: it holds, it is over, or it may be repeated at any time."""
PendingPlace = tuple[int, Phase]
"""A configuration with a pending answer."""


@dataclass(frozen=True, slots=True)
class DeadEnd:
    """A pending answer that cannot come: the configuration with the request, and the path."""

    start: int
    path: tuple[Edge, ...]
    can_retry: bool
    """Whether a repeated request may be answered."""


class PendingAnswers:
    """The places of a graph where an answer is pending.

    An unknown request may hold or not; an unknown answer counts as an answer.
    """

    def __init__(
        self,
        graph: Graph,
        requested: Sequence[TruthValue],
        answered: Sequence[TruthValue],
        deadline_s: Fraction,
    ) -> None:
        """`requested` and `answered` are the truth values in each configuration."""
        self._graph, self._requested, self._answered = graph, requested, answered
        self._deadline = deadline_s / graph.composition.tick_s

    def dead_end(self, starts: Iterable[int]) -> DeadEnd | None:
        """The dead end with the easiest way, for requests in some configurations."""
        begins: list[PendingPlace] = [(n, self._phase(n)) for n in starts]
        places = reachable(
            begins, lambda place: [target for target, _ in self._still_pending(place)]
        )
        until_anew = self._dead_places(places)
        for_ever = self._dead_places((number, "ever") for number, _ in places)
        costs = {place: self._graph.cost(place[0]) for place in begins}
        before = dict[PendingPlace, tuple[PendingPlace, Edge]]()
        waiting = [(cost, place) for place, cost in costs.items()]
        heapify(waiting)
        while waiting:
            cost, place = heappop(waiting)
            is_closed = (place[0], "ever") in for_ever
            if is_closed or place in until_anew:
                path = list[Edge]()
                while place in before:
                    place, edge = before[place]
                    path.insert(0, edge)
                return DeadEnd(place[0], tuple(path), not is_closed)
            for target, edge in self._still_pending(place):
                if target not in costs or extended_cost(cost, edge) < costs[target]:
                    costs[target], before[target] = extended_cost(cost, edge), (place, edge)
                    heappush(waiting, (costs[target], target))
        return None

    def _phase(self, number: int) -> Phase:
        return "over" if self._requested[number] is False else "asked"

    def _still_pending(self, place: PendingPlace) -> Iterator[tuple[PendingPlace, Edge]]:
        """Where the answer is still pending after a step; the request may be made anew."""
        for edge in self._continuing_edges(place[0]):
            if self._answered[edge.target] is False:
                yield (edge.target, self._phase(edge.target)), edge

    def _continuing_edges(self, number: int) -> list[Edge]:
        return self._graph.continuing_edges(number) if number < len(self._graph.edges) else []

    def _next_places(self, place: PendingPlace) -> Iterator[PendingPlace | None]:
        """The places after a step on which no request is made anew; None for an answer."""
        number, phase = place
        if number >= len(self._graph.edges):  # nothing is known of what follows
            yield None
        for edge in self._continuing_edges(number):
            yield from self._places_after(phase, edge)

    def _places_after(self, phase: Phase, edge: Edge) -> Iterator[PendingPlace | None]:
        target = edge.target
        requested = self._requested[target]
        if phase == "over" and requested is True:
            return  # what answers now answers the request that is made anew
        if self._answered[target] is not False:
            yield None
        elif phase == "ever":
            yield target, "ever"
        else:
            if requested is not False and phase == "asked":
                yield target, "asked"
            if requested is not True:
                yield target, "over"

    def _places_with_moves(self, here: PendingPlace) -> list[tuple[PendingPlace, Moves]]:
        """The places after a step on which neither an answer nor a request comes."""
        return [
            (place, edge.transitions)
            for edge in self._continuing_edges(here[0])
            for place in self._places_after(here[1], edge)
            if place
        ]

    def _dead_places(self, places: Iterable[PendingPlace]) -> set[PendingPlace]:
        """The places from which no answer comes, although a run may last beyond the deadline."""
        known = reachable(places, lambda place: filter(None, self._next_places(place)))
        pairs = [(target, here) for here in known for target in self._next_places(here)]
        before = grouped(pairs)
        answered = reachable([None], lambda place: before.get(place, ()))
        closed = {place for place in known if place not in answered}
        stays = longest_stays(
            closed,
            self._places_with_moves,
            lambda place: self._graph.elapsed_ticks(place[0]),
        )
        return {place for place in closed if stays.get(place, inf) > self._deadline}
