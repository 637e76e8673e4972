"""Whether the graphs that exploring makes have each run: they simulate the generated code.

It knows the insides of a graph: the states of machines, and the values of memory that it follows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import count
from random import Random
from typing import Any
from unittest import mock

from specc.model import expr as m
from specc.tools.explore.composition import Composition, Configuration
from specc.tools.explore.graph import Graph
from specc.tools.explore.regions import BoundedUnknown, Region
from tests.explore.enumeration import Enumeration

Places = Mapping[str, tuple[str, Mapping[str, Any]]]
"""The state and the memory of each machine."""


@contextmanager
def made_graphs() -> Iterator[list[Graph]]:
    """The graphs that are made meanwhile."""
    graphs = list[Graph]()
    make = Graph.__init__

    def noted(graph: Graph, *arguments: Any, **options: Any) -> None:
        make(graph, *arguments, **options)
        graphs.append(graph)

    with mock.patch.object(Graph, "__init__", noted):
        yield graphs


def has_every_run(graph: Graph) -> bool:
    """Whether a graph is meant to, with each tick."""
    forced = graph.composition._only_forced
    # Where repeated steps are one edge, ticks are left out.
    jumps = any(getattr(edge, "loop", ()) for edges in graph.edges for edge in edges)
    return graph.is_complete and not forced and not jumps and not graph.composition.copies


def random_run(there: Enumeration, rng: Random, ticks: int) -> list[Places]:
    """A run of the generated code, as it was enumerated."""
    found, edges = list[Places](), there.first
    while len(found) < ticks and edges:
        number = rng.choice(edges).target
        parts = zip(there.machines, there.configurations[number].parts, strict=True)
        found.append(
            {
                machine.name: (
                    part.local[0],
                    dict(zip(machine.memory, part.local[2], strict=True)),
                )
                for machine, part in parts
            }
        )
        edges = there.edges[number] if number < len(there.edges) else []
    return found


def unlike_run(graph: Graph, run: Sequence[Places], tick_s: float) -> str:
    """Where a run leaves a graph; nothing if it never does."""
    composition = graph.composition
    per_tick = round(float(composition.tick_s) / tick_s)
    here, tick = {0} if admits(composition, graph.configurations[0], run[0]) else set(), 0
    while here:
        tick += _until_due(composition, graph.configurations[min(here)].phase) * per_tick
        following = {edge.target for n in here for edge in graph.edges[n] if not edge.ends_run}
        if tick >= len(run):
            return ""
        here = {n for n in following if admits(composition, graph.configurations[n], run[tick])}
    at = run[min(tick, len(run) - 1)]
    return f"{composition.names} {composition.precision}: tick {tick}, {at}"


def _until_due(composition: Composition, phase: int) -> int:
    """The base ticks of a slice until one of its machines is due again."""
    return next(n for n in count(1) if composition.due[(phase + n) % composition.hyperperiod])


def admits(composition: Composition, configuration: Configuration, places: Places) -> bool:
    """Whether a configuration stands for these states and this memory."""
    locals_ = composition.machine_states(configuration)
    for walker, local in zip(composition.walkers, locals_, strict=True):
        state, memory = places[walker.name]
        if local.state != state:
            return False
        for name, slot in walker.memory_slots.items():
            if not stands_for(walker.values.value(local.memory[slot]), memory[name]):
                return False
    return True


def stands_for(value: object, real: Any) -> bool:
    """Whether a value of a graph stands for one of generated code."""
    match value:
        case Region(low, high) | BoundedUnknown(low, high):
            return bool(low <= real <= high)
        case m.Number():
            return bool(value.value == real)
    return True
