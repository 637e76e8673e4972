"""Says which values make the graph of a slice large.

The number of values that an element has says little about that: seven values of a number of retries
may double all configurations. So it is counted how many configurations still differ when the value
is left out.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from functools import partial
from typing import Literal, NamedTuple

from specc.tools.explore.composition import MachineConfiguration
from specc.tools.explore.graph import Graph
from specc.tools.explore.transitions import MachineState
from specc.tools.explore.values import Interner
from specc.tools.explore.walker import Walker

LEAST_FACTOR = 1.5
MOST_NAMED = 3
MOST_LOOKUPS = 2_000_000
"""Configurations times values: of a larger graph only the first configurations are compared."""
SizeKind = Literal["memory", "input", "clock"]
Reduction = Callable[[MachineConfiguration], Hashable]
"""Gives what is left of a machine without one of its values."""


class SizeFactor(NamedTuple):
    """How many times as many configurations there are because of a value."""

    kind: SizeKind
    name: str
    factor: float


def size_factors(graph: Graph) -> tuple[SizeFactor, ...]:
    """The values that make a graph large, the worst first."""
    values = [
        (index, *value)
        for index, walker in enumerate(graph.composition.walkers)
        for value in _values(walker)
    ]
    seen = graph.configurations[: max(1, MOST_LOOKUPS // max(1, len(values)))]
    found = []
    for index, kind, name, reduced in values:
        numbers = {each.parts[index] for each in seen}
        by_number = graph.composition.machine_configurations(index)
        rests = Interner()
        less = {number: rests.number(reduced(by_number[number])) for number in numbers}
        if len(rests) == len(less):
            continue
        different = {
            (c.phase, c.tracker_state, c.parts[:index], less[c.parts[index]], c.parts[index + 1 :])
            for c in seen
        }
        found.append(SizeFactor(kind, name, len(seen) / len(different)))
    large = (each for each in found if each.factor >= LEAST_FACTOR)
    return tuple(sorted(large, key=lambda each: (-each.factor, each.name)))[:MOST_NAMED]


def _values(walker: Walker) -> Iterator[tuple[SizeKind, str, Reduction]]:
    for name, slot in walker.memory_slots.items():
        yield "memory", f"{walker.name}.{name}", partial(_without_memory, walker, slot)
    for (peer, name), slot in walker.slots.items():
        yield "input", f"{walker.name}.x.{peer}.{name}", partial(_without_input, slot)
    yield "clock", walker.name, partial(_without_clock, walker)


def _without_memory(walker: Walker, slot: int, part: MachineConfiguration) -> Hashable:
    local: MachineState = walker.states.by_number[part.state]
    memory = local.memory[:slot], local.memory[slot + 1 :]
    return local.state, local.clock, memory, local.answers, part.buffers, part.pending


def _without_input(slot: int, part: MachineConfiguration) -> Hashable:
    is_fresh = part.buffers[slot] % 2
    buffers = part.buffers[:slot], is_fresh, part.buffers[slot + 1 :]
    return part.state, buffers, part.pending


def _without_clock(walker: Walker, part: MachineConfiguration) -> Hashable:
    local: MachineState = walker.states.by_number[part.state]
    return local.state, local.memory, local.answers, part.buffers, part.pending
