"""From coarse to fine: what was found is looked for again, ever more exactly.

Time in a state is first taken to pass in any way, and of each element only so many values are
followed. What was found so is dropped only if it is not there in what was explored completely on
an abstraction that is finer in every respect.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TypeVar

from specc.tools.explore.composition import COARSEST, Precision
from specc.tools.explore.graph import Graph

FOR_TIME, FOR_VALUES = 8, 64
"""One part in so many is for a finer abstraction where nothing was found on the coarser one.

The smaller part is where that was complete, so that only a machine that waits may be hidden.
"""
About = TypeVar("About")
What = TypeVar("What")
Told = list[tuple[Graph, Mapping[About, What]]]
"""Graphs from coarse to fine, each with what was found in it."""


def refined(
    build: Callable[[Precision, int], Graph],
    look: Callable[[Graph], Mapping[About, What]],
    budget: int,
) -> Told[About, What]:
    """The graphs of one slice, each in about so many steps at most, until nothing is open."""
    told: Told[About, What] = []

    def explored(precision: Precision, budget: int) -> Graph:
        graph = build(precision, budget)
        told.append((graph, look(graph)))
        return graph

    graph = explored(COARSEST, budget)
    found = told[-1][1]
    is_open = found or not graph.complete or graph.composition.widened
    # Without measurements, time alone makes ways that counting it closes again.
    if is_open and graph.composition.is_timed and not graph.broken_off:
        least = budget // (FOR_VALUES if graph.complete else FOR_TIME)
        counted = explored(Precision(exact=True), budget if found else least)
        if counted.complete or counted.broken_off:
            graph, found = counted, told[-1][1]
    if graph.composition.widened and not graph.broken_off:
        finest = Precision(graph.composition.precision.exact, None)
        explored(finest, budget if found else budget // FOR_VALUES)
    return told


def not_refuted(told: Told[About, What]) -> dict[About, tuple[What, bool]]:
    """What was found, as the finest graph has it, and whether nothing in that is coarse.

    That it is not there on another one that is complete, and finer, refutes it.
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
    """Of graphs from coarse to fine, the last one that is complete, or else the coarsest."""
    every = list(graphs)
    done = (graph for graph in reversed(every) if graph.complete or graph.broken_off)
    return next(done, every[0])
