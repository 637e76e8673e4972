"""Abstraction refinement: findings are looked for again on finer abstractions.

The first abstraction lets any time pass in a state, and follows a bounded number of values of each
element. A finding is dropped only if it is absent from the complete graph of an abstraction that
is finer in every respect.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from specc.tools.explore.composition import COARSEST, Precision
from specc.tools.explore.graph import Graph

FOR_TIME, FOR_VALUES, FOR_REALS = 8, 64, 256
"""One part in so many of the budget is for a finer abstraction without findings on the coarse one.

The smaller parts are for a coarse graph that was complete: it can hide only waiting machines. Whole
numbers between constants come to an end, real ones may have new values for ever.
"""
LEAST = 2000
"""Steps, if the budget allows for as many: with fewer, a finer abstraction finds nothing."""
About = TypeVar("About")
What = TypeVar("What")
Told = list[tuple[Graph, Mapping[About, What]]]
"""Graphs from coarse to fine, each with its findings."""


def refined(
    build: Callable[[Precision, int], Graph],
    look: Callable[[Graph], Mapping[About, What]],
    budget: int,
) -> Told[About, What]:
    """The graphs of one slice, each of at most about `budget` steps, until nothing is open."""
    told: Told[About, What] = []

    def explored(precision: Precision, budget: int) -> Graph:
        graph = build(precision, budget)
        told.append((graph, look(graph)))
        return graph

    graph = explored(COARSEST, budget)
    found = told[-1][1]
    is_open = found or not graph.complete or graph.composition.widened
    share = budget // (FOR_REALS if graph.composition.values.has_reals else FOR_VALUES)
    share = min(budget, max(share, LEAST))
    # Time that may pass in any way adds traces, which counting it removes.
    if is_open and graph.composition.is_timed and not graph.broken_off:
        least = share if graph.complete else budget // FOR_TIME
        steps = budget if found else least
        # Without a step it would be the first state again, and making machines takes time, too.
        counted = explored(Precision(exact=True), steps) if steps else graph
        if counted.complete or counted.broken_off:
            graph, found = counted, told[-1][1]
    if budget and graph.composition.widened and not graph.broken_off:
        finest = Precision(graph.composition.precision.exact, None)
        explored(finest, budget if found else share)
    return told


def not_refuted(told: Told[About, What]) -> dict[About, tuple[What, bool]]:
    """The findings that no finer, complete graph refutes by lacking them.

    Each is as in the finest graph that has it, with whether that graph is exact.
    """
    kept: dict[About, tuple[What, bool]] = {}
    for index, (graph, there) in enumerate(told):
        finer = [
            other
            for after, other in told[index + 1 :]
            if after.complete and after.composition.precision.refines(graph.composition.precision)
        ]
        for about, what in there.items():
            if all(about in other for other in finer):
                kept[about] = what, graph.is_exact
    return kept


def best(graphs: Iterable[Graph]) -> Graph:
    """Of graphs from coarse to fine, the last one that is complete, else the coarsest."""
    every = list(graphs)
    done = (graph for graph in reversed(every) if graph.complete or graph.broken_off)
    return next(done, every[0])
