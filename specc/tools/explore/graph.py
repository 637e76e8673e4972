"""The graph of configurations of a slice, and the easiest path to each configuration.

The path to a finding is shown to people and tried on the generated code. So the easiest path is
the one with the fewest avoidable transitions; among equals the shortest; among these the one whose
avoidable transitions come first; among these the one on which the fewest values are lost. Early
transitions fit constant measurements, with which a condition holds when it is first asked, or
never. A machine that is stuck although nothing was lost has the simpler explanation.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar
from fractions import Fraction
from functools import cached_property, reduce
from heapq import heappop, heappush
from mmap import mmap
from typing import Literal, NamedTuple

from specc.tools.explore.composition import Composition, Configuration, Edge
from specc.tools.explore.regions import Region
from specc.tools.explore.symmetry import Permutation, composed
from specc.tools.explore.transitions import FAILED, MachineState

PathEdge = tuple[int, Edge]
"""An edge, and the configuration from which it leads."""
Cost = tuple[int, int, int, int]
"""Of a way: rows taken where something else was possible, steps, how late these rows are, and how
many values are lost."""
BrokenOff = Literal["", "interrupted", "out of memory"]
RESERVE = 1 << 25
"""Bytes that are released when memory runs out, so that findings can be printed."""
WATCHED_EVERY = 256
"""Configurations between two calls of the watcher, and of what ends the search."""
watcher: ContextVar[Callable[[Graph], None] | None] = ContextVar("watcher", default=None)
"""Is called with each graph while it is explored, such as to print how far it is."""
_UNREACHED: Cost = 1 << 62, 0, 0, 0


def broken_off(error: KeyboardInterrupt | MemoryError) -> BrokenOff:
    """The reason for which exploring was broken off."""
    return "out of memory" if isinstance(error, MemoryError) else "interrupted"


def _reserve_memory() -> mmap:
    """Memory that is reserved unwritten, since clearing it took longer than most explorations."""
    try:
        return mmap(-1, RESERVE)
    except OSError as error:
        raise MemoryError from error


class Graph:
    """The configurations that were found, and the edges between them.

    `faults` are edges that end runs. `violated`
    are the requirements that some edge, or the beginning, violates.
    """

    def __init__(
        self,
        composition: Composition,
        budget: int,
        until: Callable[[Composition], bool] = lambda composition: False,
    ) -> None:
        """Explore with at most about `budget` steps of single machines.

        The search ends early, incomplete, once `until` holds of the composition.
        """
        self.composition = composition
        first, initial = composition.start()
        self.initial_transitions = initial.transitions
        self.configurations = [first]
        self.edges: list[list[Edge]] = []
        self.faults: list[PathEdge] = []
        self.violated = set(initial.violated)
        self._violations: list[PathEdge] = []
        self.steps = 0
        self.broken_off: BrokenOff = ""
        self._initial_edge = initial
        self._numbers = {first: 0}
        self._ticks = [0]
        try:
            with _reserve_memory():
                self._explore(budget, until)
        except (KeyboardInterrupt, MemoryError) as error:  # findings so far are printed
            self.broken_off = broken_off(error)

    @property
    def is_complete(self) -> bool:
        """Whether the edges of every configuration were followed."""
        return len(self.edges) == len(self.configurations)

    @property
    def may_fail(self) -> bool:
        """Whether some step ends a run, the first one included."""
        first = self.composition.machine_states(self.configurations[0])
        return bool(self.faults) or any(state.clock == FAILED for state in first)

    @property
    def is_counted(self) -> bool:
        """Whether time was counted where it matters."""
        return self.composition.precision.counts_time or not self.composition.is_timed

    @property
    def is_exact(self) -> bool:
        """Whether all values were followed as well."""
        return self.is_counted and not self.composition.widened

    def depth_s(self, number: int) -> Fraction:
        """The time at which a configuration was found."""
        return self._ticks[number] * self.composition.tick_s

    def _explore(self, budget: int, until: Callable[[Composition], bool]) -> None:
        watch = watcher.get()
        while len(self.edges) < len(self.configurations):
            here = len(self.edges)
            out: list[Edge] = []
            if here % WATCHED_EVERY == 0:
                if until(self.composition):
                    return
                if watch:
                    watch(self)
            for successor, label in self.composition.successors(self.configurations[here]):
                # One configuration may have more edges than the budget has steps.
                if self.steps >= budget:
                    return
                edge = Edge(self._number_of(successor, here), *label)
                self.steps += len(edge.transitions)
                out.append(edge)
                if edge.ends_run:
                    self.faults.append((here, edge))
                if edge.violated:  # kept even if not all edges from here are followed
                    self._violations.append((here, edge))
                    self.violated.update(edge.violated)
            self.edges.append(out)

    def continuing_edges(self, number: int) -> list[Edge]:
        """The edges from a configuration that no fault ends."""
        return [edge for edge in self.edges[number] if not edge.ends_run]

    def elapsed_ticks(self, here: int) -> int:
        """The base ticks of the slice that an edge from a configuration takes."""
        return self.composition.elapsed_ticks(self.configurations[here].phase)

    def _number_of(self, successor: Configuration, here: int) -> int:
        number = self._numbers.get(successor)
        if number is None:
            number = self._numbers[successor] = len(self.configurations)
            self.configurations.append(successor)
            self._ticks.append(self._ticks[here] + self.elapsed_ticks(here))
        return number

    def region(self, number: int, counter: tuple[int, str]) -> Region | None:
        """The region of a number in the memory of a machine, by index, in a configuration.

        None if copies may change places, so that the machine is another one after an edge.
        """
        index, name = counter
        walker = self.composition.walkers[index]
        part = self.configurations[number].parts[index]
        local = self.composition.machine_configurations(index)[part].state
        state: MachineState = walker.states.by_number[local]
        value = walker.values.value(state.memory[walker.memory_slots[name]])
        return value if isinstance(value, Region) and not self.composition.copies else None

    # The easiest paths.

    def cost(self, number: int, *last: Edge) -> Cost:
        """The cost of the easiest path to a configuration and over further edges."""
        return reduce(extended_cost, last, self._easiest_paths.costs[number])

    def easiest_path(self, number: int) -> list[PathEdge]:
        """The easiest path to a configuration: edges, each with the configuration it leaves."""
        found, before = list[PathEdge](), self._easiest_paths.before
        while (passage := before[number]) is not None:
            found.append(passage)
            number = passage[0]
        return found[::-1]

    def frame(self, number: int) -> Permutation:
        """The frame at its end: for each machine the real machine that it stands for."""
        return self._easiest_paths.frames[number] if self.composition.copies else self._identity

    def violation(self, requirement: int) -> tuple[int, tuple[Edge, ...]]:
        """The easiest violation of a requirement: a configuration, and the edge, if any."""
        if requirement in self._initial_edge.violated:
            return 0, ()
        number, edge = min(
            ((n, e) for n, e in self._violations if requirement in e.violated),
            key=lambda passage: self.cost(*passage),
        )
        return number, (edge,)

    @cached_property
    def _identity(self) -> Permutation:
        return tuple(range(len(self.composition.names)))

    @cached_property
    def _easiest_paths(self) -> _EasiestPaths:
        every = len(self.configurations)
        paths = _EasiestPaths([_UNREACHED] * every, [None] * every, [self._identity] * every)
        paths.costs[0] = 0, 0, 0, 0
        waiting = [(paths.costs[0], 0)]
        while waiting:
            cost, number = heappop(waiting)
            if cost > paths.costs[number] or number >= len(self.edges):
                continue
            for edge in self.edges[number]:
                successor = extended_cost(cost, edge)
                if successor < paths.costs[edge.target]:
                    paths.costs[edge.target] = successor
                    paths.before[edge.target] = number, edge
                    paths.frames[edge.target] = composed(paths.frames[number], edge.permutation)
                    heappush(waiting, (successor, edge.target))
        return paths


class _EasiestPaths(NamedTuple):
    """The easiest path to each configuration: its cost, its last edge, and the frame there."""

    costs: list[Cost]
    before: list[PathEdge | None]
    frames: list[Permutation]


def extended_cost(cost: Cost, edge: Edge) -> Cost:
    """The cost of a way with one more edge."""
    choices, steps, late, lost = cost
    avoidable = sum(move.row >= 0 and bool(move.choices) for _, move in edge.transitions)
    lost += len(edge.overwritten) + sum(len(move.lost) for _, move in edge.transitions)
    return (
        choices + avoidable,
        steps + 1,
        late + avoidable * steps,
        lost,
    )
