"""Acceleration: repeated steps become one edge, up to where a condition may turn.

On a path without branches machines may repeat their steps, so that only quantities change, each
by a constant: counters, values sent from them, and the time in states. Three configurations show
the constants. Then each step is evaluated once more with arithmetic progressions in place of
numbers, for all repetitions at once: it must be the same step and lead to the next values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple, TypeVar

from specc.model import expr as m
from specc.proof.clock import LONGEST
from specc.tools.explore.composition import Composition, Configuration, Edge, MachineConfiguration
from specc.tools.explore.partial import SOME, AbstractValue, KnownValues, residual
from specc.tools.explore.progressions import Progression, is_minus_zero
from specc.tools.explore.symmetry import Permutation
from specc.tools.explore.tracker import RequirementTracker, TrackerState
from specc.tools.explore.transitions import MachineState, Transition
from specc.tools.explore.walker import Walker

MIN_PATH = 16
"""Edges without a branch before the search for repetitions, which is repeated at twice as many."""
MAX_LOOP = 1024
"""The most edges of one repetition."""
MIN_REPETITIONS = 64
"""The fewest repetitions that are worth an edge."""
CONSTANT = Progression(Fraction(0), Fraction(0))
Key = TypeVar("Key")


class MachineSnapshot(NamedTuple):
    """A part of a configuration: its fixed part, clocks, and numbers of values."""

    shape: tuple[object, ...]
    clocks: tuple[int, ...]
    numbers: tuple[int, ...]


class Increments(NamedTuple):
    """What one repetition adds to each clock and value."""

    clocks: tuple[int, ...]
    values: tuple[Fraction, ...]


class RepeatedStep(NamedTuple):
    """The step of a machine: before it, the buffers that it reads, after it, and the move."""

    walker: Walker
    before: MachineState
    buffers: tuple[int, ...]
    after: MachineState
    move: Transition


def accelerate(
    composition: Composition, path: Sequence[Configuration], edges: Sequence[Edge]
) -> tuple[Configuration, Edge] | None:
    """An edge for the repetitions that follow a path without branches, if there are many of them.

    `edges` lead from each configuration of `path` to the next one.
    """
    for length in range(1, len(edges) // 2 + 1):
        first = len(edges) - 2 * length
        begin, middle, end = path[first], path[first + length], path[-1]
        slopes = _increments(composition, middle, end)
        if slopes and slopes == _increments(composition, begin, middle):
            loop = Loop(composition, path[first:], edges[first:], slopes)
            if not loop.is_repeated():
                return None  # longer repetitions have the same steps in them
            if loop.waiting_monitors is not None:
                return loop.edge()
    return None


def _snapshots(composition: Composition, here: Configuration) -> Iterator[MachineSnapshot]:
    """The shared part, then each machine."""
    seen = composition.tracker.state(here.tracker_state).values if composition.tracker else ()
    yield MachineSnapshot((here.phase,), (), seen)
    for walker, part in zip(composition.walkers, composition.parts_of(here), strict=True):
        local: MachineState = walker.states.by_number[part.state]
        fresh = [number % 2 for number in part.buffers]
        pending = [key for key, _ in part.pending]
        numbers = (*local.memory, *(number // 2 for number in part.buffers))
        numbers += tuple(number for _, number in part.pending)
        yield MachineSnapshot((local.state, local.answers, fresh, pending), (local.clock,), numbers)


def _increments(
    composition: Composition, one: Configuration, two: Configuration
) -> Increments | None:
    """What is added from one configuration to another one; None if they differ in more."""
    value = composition.values.value
    clocks, slopes = list[int](), list[Fraction]()
    for a, b in zip(_snapshots(composition, one), _snapshots(composition, two), strict=True):
        if a.shape != b.shape:
            return None
        for before, after in zip(a.numbers, b.numbers, strict=True):
            line = (
                CONSTANT if before == after else _progression_through(value(before), value(after))
            )
            if line is None:
                return None
            slopes.append(line.step)
        clocks += (after - before for before, after in zip(a.clocks, b.clocks, strict=True))
    return Increments(tuple(clocks), tuple(slopes))


def _progression_through(
    one: AbstractValue | None, two: AbstractValue | None
) -> Progression | None:
    """The progression through two numbers; None with -0.0."""
    if not (isinstance(one, m.Number) and isinstance(two, m.Number)):
        return None
    if is_minus_zero(one.value) or is_minus_zero(two.value):
        return None
    return Progression(Fraction(one.value), Fraction(two.value) - Fraction(one.value))


def _largest_passing(test: Callable[[int], bool], limit: int) -> int:
    """The greatest number up to a limit that passes a test, as smaller ones do."""
    low, high = 0, limit
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if test(middle) else (low, middle - 1)
    return low


class Loop:
    """Steps of all machines that were taken twice, and what each repetition adds."""

    def __init__(
        self,
        composition: Composition,
        path: Sequence[Configuration],
        edges: Sequence[Edge],
        increments: Increments,
    ) -> None:
        self._composition, self._path, self._edges = composition, path, edges
        self._increments = increments
        self._initial_numbers = [
            n for each in _snapshots(composition, path[0]) for n in each.numbers
        ]
        self._length = len(edges) // 2
        pairs = [pair for at in range(self._length) for pair in self._step_pairs(at)]
        # Equal states and buffers give equal steps.
        self._steps = [(a, b) for a, b in pairs if (a.before, a.buffers) != (b.before, b.buffers)]
        self._ticks = sum(composition.durations[each.phase] for each in path[: self._length])

    def is_repeated(self) -> bool:
        """Whether the machines, apart from monitors, repeat their steps often enough."""
        return all(map(self._is_repeated_edge, range(self._length))) and self._steps_hold_for(
            MIN_REPETITIONS
        )

    @cached_property
    def waiting_monitors(self) -> dict[int, list[m.Expr]] | None:
        """The monitors that approach a deadline, with their conditions.

        None if some other monitor changed its state.
        """
        tracker, path = self._composition.tracker, self._path
        if tracker is None:
            return {}
        begin, *after = (tracker.state(each.tracker_state).states for each in path[:: self._length])
        moved = [i for i, state in enumerate(begin) if any(each[i] != state for each in after)]
        if not moved:
            return {}
        first, *others = (tracker.conditions(self._known_at(tracker, each)) for each in path[1:])
        if any(each[index] != first[index] for each in others for index in moved):
            return None
        return {index: first[index] for index in moved}

    def _known_at(self, tracker: RequirementTracker, here: Configuration) -> KnownValues:
        return tracker.known_values(here.tracker_state, self._composition.machine_states(here))

    def _step_pairs(self, at: int) -> Iterator[tuple[RepeatedStep, RepeatedStep]]:
        return zip(self._steps_at(at), self._steps_at(at + self._length), strict=True)

    def _steps_at(self, at: int) -> Iterator[RepeatedStep]:
        composition = self._composition
        here, after_last = map(composition.parts_of, self._path[at : at + 2])
        composition.deliver(composition.due[self._path[at + 1].phase], here)
        for i, move in self._edges[at].transitions:
            walker = composition.walkers[i]
            before, after = (
                walker.states.by_number[parts[i].state] for parts in (here, after_last)
            )
            yield RepeatedStep(walker, before, here[i].buffers, after, move)

    def edge(self) -> tuple[Configuration, Edge] | None:
        """The edge for all further repetitions, and the configuration after them."""
        edges = self._edges[: self._length]
        if not self._holds_for(MIN_REPETITIONS):
            return None
        exact = _largest_passing(self._is_exact, LONGEST)
        if self._holds_for(exact):
            return None  # nothing turns while numbers are exact
        times = _largest_passing(self._holds_for, exact)
        landed = self._configuration_after(times)
        if landed is None:
            return None
        after_last, turn = landed
        moves = tuple(move for edge in edges for move in edge.transitions)
        # Two of them were taken.
        return after_last, Edge(-1, moves, permutation=turn, loop=tuple(edges), times=times - 2)

    def _is_repeated_edge(self, at: int) -> bool:
        """Whether an edge was repeated and takes no avoidable row."""
        one, two = (self._edges[each] for each in (at, at + self._length))
        is_free = any(move.row >= 0 and move.choices for _, move in one.transitions)
        # Overwritten values that differ twice are equal once at most.
        return not is_free and not one.permutation and _without_values(one) == _without_values(two)

    def _is_exact(self, times: int) -> bool:
        value, slopes = self._composition.values.value, self._increments.values
        each = zip(map(value, self._initial_numbers), slopes, strict=True)
        lines = (
            Progression(Fraction(v.value), slope) for v, slope in each if isinstance(v, m.Number)
        )
        return all(line.is_exact(times + 1) for line in lines if line.step)

    def _holds_for(self, times: int) -> bool:
        """Whether `times` repetitions, counted from the first, take the same steps.

        They also leave the conditions of the monitors unchanged.
        """
        tracker, initial_state_number = self._composition.tracker, self._path[0].tracker_state
        if not self._steps_hold_for(times):
            return False
        if tracker is None:
            return True
        for index, conditions in (self.waiting_monitors or {}).items():
            if times * self._ticks > tracker.ticks_until_change(
                index, tracker.state(initial_state_number).states[index], conditions
            ):
                return False
        return all(
            conditions == tracker.conditions(_with_progressions(one, two, times))
            for one, two, conditions in self._conditions
        )

    @cached_property
    def _conditions(self) -> list[tuple[KnownValues, KnownValues, list[list[m.Expr]]]]:
        """The conditions of monitors at steps whose values differ in the next repetition."""
        tracker = self._composition.tracker
        if tracker is None:
            return []
        seen = [self._known_at(tracker, each) for each in self._path]
        pairs = zip(seen[1:], seen[self._length + 1 :], strict=False)
        return [(a, b, tracker.conditions(a)) for a, b in pairs if a.memory != b.memory]

    def _steps_hold_for(self, times: int) -> bool:
        return all(_is_same_step(one, two, times) for one, two in self._steps)

    def _configuration_after(self, times: int) -> tuple[Configuration, Permutation] | None:
        """The configuration after so many repetitions; None if its values are not tracked."""
        composition, first = self._composition, self._path[0]
        pairs = zip(self._initial_numbers, self._increments.values, strict=True)
        numbers = iter([composition.values.shifted(n, times * slope) for n, slope in pairs])
        tracker, tracker_state = composition.tracker, first.tracker_state
        if tracker is not None:
            states, seen, *_ = map(list, tracker.state(tracker_state))
            for index, conditions in (self.waiting_monitors or {}).items():
                states[index] = tracker.monitor_after(
                    index, states[index], conditions, times * self._ticks
                )
            tracker_state = tracker.state_number_of(
                TrackerState(tuple(states), tuple(next(numbers) for _ in seen))
            )
        passed, parts = iter(self._increments.clocks), list[MachineConfiguration]()
        for walker, part in zip(composition.walkers, composition.parts_of(first), strict=True):
            local: MachineState = walker.states.by_number[part.state]
            memory = tuple(next(numbers) for _ in local.memory)
            buffers = tuple(2 * next(numbers) + number % 2 for number in part.buffers)
            pending = tuple((key, next(numbers)) for key, _ in part.pending)
            local = local._replace(clock=local.clock + times * next(passed), memory=memory)
            if not walker.track_values(local, pending):
                return None
            parts.append(MachineConfiguration(walker.states.number(local), buffers, pending))
        ordered, turn = composition.sort_copies(parts)
        return composition.configuration_of(first.phase, ordered, tracker_state), turn


def _without_values(edge: Edge) -> Edge:
    """An edge without the values that are sent, and where it leads."""
    moves = tuple((i, move._replace(sent=())) for i, move in edge.transitions)
    return edge._replace(target=0, transitions=moves)


def _is_same_step(one: RepeatedStep, two: RepeatedStep, times: int) -> bool:
    """Whether a step is the same on all progressions through it and the next one."""
    walker, state, clock = one.walker, one.before.state, one.before.clock
    plain, other = (walker.known_before(each.before, each.buffers) for each in (one, two))
    drawn = _with_progressions(plain, other, times)
    now, *others = walker.clocks.next_clocks(state, clock, plain)
    if others or not walker.clocks.is_constant(state, drawn, now, two.before.clock - clock, times):
        return False
    evaluated = []
    for known in (plain, drawn):
        walker.clocks.set_time(known, state, now)
        axioms = [residual(axiom, known) for axiom in walker.cone.axioms]
        evaluated.append((axioms, list(walker.branches(state, known))))
    if evaluated[0] != evaluated[1]:
        return False
    if one.move.row >= 0:
        plain, drawn = (walker.known_at_entry(one.move.row, known) for known in (plain, drawn))
    step = one.move.row, one.move.target
    written, next_ = (dict(walker.assignments(*step, known)) for known in (plain, drawn))
    given, then = (walker.assigned_numbers(each.after, each.move.sent) for each in (one, two))
    values = {key: tuple(map(walker.values.value, (given[key], then[key]))) for key in written}
    return (
        written.keys() == next_.keys()
        and all(
            given[key] == then[key]
            if expr == next_[key]
            else _is_on_progression(drawn, next_[key], *values[key])
            for key, expr in written.items()
        )
        and all(
            line is None or not line.step or timer.is_counted_over(line, times)
            for name, timer in walker.mode_timers.items()
            for line in (drawn.progression_of(next_.get(("", name), m.TRUE)),)
        )
    )


def _is_on_progression(
    drawn: KnownValues, expr: m.Expr, value: AbstractValue | None, then: AbstractValue | None
) -> bool:
    """Whether an expression follows the progression through two values, or is unknown as they are.

    Bounds and regions of unknown values may change with the numbers.
    """
    line = drawn.progression_of(expr)
    if line is None:
        return {value, then} <= {None, SOME}
    return line == _progression_through(value, then)


def _with_progressions(one: KnownValues, two: KnownValues, times: int) -> KnownValues:
    """Known values in which numbers that differ later are progressions."""
    memory, inputs = _progressions(one.memory, two.memory), _progressions(one.inputs, two.inputs)
    return replace(one, memory=memory, inputs=inputs, times=times, _residuals={})


def _progressions(
    one: Mapping[Key, AbstractValue], two: Mapping[Key, AbstractValue]
) -> dict[Key, AbstractValue]:
    pairs = ((key, value, two[key]) for key, value in one.items())
    return {key: a if a == b else (_progression_through(a, b) or SOME) for key, a, b in pairs}
