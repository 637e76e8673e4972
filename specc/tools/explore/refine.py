"""Abstraction refinement: findings are checked again on finer abstractions.

The first abstraction lets any time pass in a state, and tracks a bounded number of values of each
element. A finding is dropped only if it is absent from the complete graph of an abstraction that
is finer in every respect.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from specc.tools.explore.composition import COARSEST, Precision
from specc.tools.explore.graph import Graph

TIME_SHARE, VALUES_SHARE, REALS_SHARE = 8, 64, 256
"""One part in so many of the budget is for a finer abstraction without findings on the coarse one.

The smaller parts are for a coarse graph that was complete: it can hide only waiting machines. Whole
numbers between constants come to an end, real ones may have new values for ever.
"""
MIN_STEPS = 2000
"""Steps that a finer abstraction gets if the budget allows: with fewer it finds nothing."""
Identity = TypeVar("Identity")
Item = TypeVar("Item")
Refinement = list[tuple[Graph, Mapping[Identity, Item]]]
"""Graphs from coarse to fine, each with its findings."""


def refine(
    build: Callable[[Precision, int], Graph],
    look: Callable[[Graph], Mapping[Identity, Item]],
    budget: int,
    is_decided: Callable[[Graph], bool] = lambda graph: not graph.composition.widened,
) -> Refinement[Identity, Item]:
    """The graphs of one slice, each of at most about `budget` steps, until nothing is open.

    A complete graph without findings is the last one if it `is_decided` with it.
    """
    results: Refinement[Identity, Item] = []

    def explore(precision: Precision, budget: int) -> Graph:
        graph = build(precision, budget)
        results.append((graph, look(graph)))
        return graph

    graph = explore(COARSEST, budget)
    found = results[-1][1]
    if not found and graph.is_complete and is_decided(graph):
        return results
    share = budget // (REALS_SHARE if graph.composition.values.has_reals else VALUES_SHARE)
    share = min(budget, max(share, MIN_STEPS))
    # Time that may pass in any way adds traces, which counting it removes.
    if graph.composition.is_timed and not graph.broken_off:
        least = share if graph.is_complete else budget // TIME_SHARE
        steps = budget if found else least
        # Without a step it would be the first state again, and making machines takes time, too.
        counted = explore(Precision(counts_time=True), steps) if steps else graph
        if counted.is_complete or counted.broken_off:
            graph, found = counted, results[-1][1]
    if budget and graph.composition.widened and not graph.broken_off:
        finest = Precision(graph.composition.precision.counts_time, None)
        explore(finest, budget if found else share)
    return results


def not_refuted(results: Refinement[Identity, Item]) -> dict[Identity, tuple[Item, bool]]:
    """The findings that no finer, complete graph refutes by lacking them.

    Each is as in the finest graph that has it, with whether that graph is exact.
    """
    standing: dict[Identity, tuple[Item, bool]] = {}
    for index, (graph, found) in enumerate(results):
        finer = [
            other
            for after, other in results[index + 1 :]
            if after.is_complete
            and after.composition.precision.refines(graph.composition.precision)
        ]
        for identity, item in found.items():
            if all(identity in other for other in finer):
                standing[identity] = item, graph.is_exact
    return standing


def finest_complete(graphs: Iterable[Graph]) -> Graph:
    """Of graphs from coarse to fine, the last one that is complete, else the coarsest."""
    every = list(graphs)
    done = (graph for graph in reversed(every) if graph.is_complete or graph.broken_off)
    return next(done, every[0])
