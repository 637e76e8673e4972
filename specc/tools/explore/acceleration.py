"""Acceleration: steps that repeat are one edge, up to where a condition may turn.

On a way without branches machines may come to repeat their steps, so that only quantities change,
each by a constant: counters, what is sent of them, and the time in states. Three configurations
show the constants. Then each step is judged once more with lines in the place of numbers, which
is for all repetitions at once: it has to be the same step, and to lead to the next values.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple, TypeVar

from specc.model import expr as m
from specc.proof.clock import LONGEST
from specc.tools.explore.composition import Composition, Configuration, Edge, MachineState
from specc.tools.explore.lines import Line, is_minus_zero
from specc.tools.explore.moves import Local, Move
from specc.tools.explore.partial import SOME, AbstractValue, Known, filled
from specc.tools.explore.symmetry import Permutation
from specc.tools.explore.walker import Walker
from specc.tools.explore.watch import Watch, Watched

FIRST = 16
"""Edges without a branch after which repetitions are looked for, and again after twice as many."""
LONGEST_LOOP = 1024
"""Edges of one repetition."""
LEAST = 64
"""Repetitions that are worth it."""
STEADY = Line(Fraction(0), Fraction(0))
Key = TypeVar("Key")


class Flat(NamedTuple):
    """A part of a configuration: what has to be the same, clocks, and numbers of values."""

    shape: tuple[object, ...]
    clocks: tuple[int, ...]
    numbers: tuple[int, ...]


class Slopes(NamedTuple):
    """What one repetition adds to each clock and value."""

    clocks: tuple[int, ...]
    values: tuple[Fraction, ...]


class Period(NamedTuple):
    """The step of a machine: before it, the buffers that it reads, after it, and the move."""

    walker: Walker
    before: Local
    buffers: tuple[int, ...]
    after: Local
    move: Move


def accelerated(
    composition: Composition, way: Sequence[Configuration], edges: Sequence[Edge]
) -> tuple[Configuration, Edge] | None:
    """An edge for the repetitions that follow a way without branches, if there are many of them.

    `edges` lead from each configuration of `way` to the next one.
    """
    for length in range(1, len(edges) // 2 + 1):
        first = len(edges) - 2 * length
        begin, middle, end = way[first], way[first + length], way[-1]
        slopes = _slopes(composition, middle, end)
        if slopes and slopes == _slopes(composition, begin, middle):
            loop = Loop(composition, way[first:], edges[first:], slopes)
            if not loop.repeats():
                return None  # longer repetitions have the same steps in them
            if loop.waiting is not None:
                return loop.edge()
    return None


def _flat(composition: Composition, here: Configuration) -> Iterator[Flat]:
    """What the machines share, then each machine."""
    seen = composition.watch.at(here.watched).seen if composition.watch else ()
    yield Flat((here.phase,), (), seen)
    for walker, part in zip(composition.walkers, composition.parts_of(here), strict=True):
        local: Local = walker.locals.things[part.local]
        fresh = [number % 2 for number in part.buffers]
        pending = [key for key, _ in part.pending]
        numbers = (*local.memory, *(number // 2 for number in part.buffers))
        numbers += tuple(number for _, number in part.pending)
        yield Flat((local.state, local.answers, fresh, pending), (local.clock,), numbers)


def _slopes(composition: Composition, one: Configuration, two: Configuration) -> Slopes | None:
    """What is added from one configuration to another one; None if they differ in more."""
    value = composition.values.value
    clocks, slopes = list[int](), list[Fraction]()
    for a, b in zip(_flat(composition, one), _flat(composition, two), strict=True):
        if a.shape != b.shape:
            return None
        for before, after in zip(a.numbers, b.numbers, strict=True):
            line = STEADY if before == after else _line(value(before), value(after))
            if line is None:
                return None
            slopes.append(line.slope)
        clocks += (after - before for before, after in zip(a.clocks, b.clocks, strict=True))
    return Slopes(tuple(clocks), tuple(slopes))


def _line(one: AbstractValue | None, two: AbstractValue | None) -> Line | None:
    """The line through two numbers; -0.0 is on none."""
    if not (isinstance(one, m.Number) and isinstance(two, m.Number)):
        return None
    if is_minus_zero(one.value) or is_minus_zero(two.value):
        return None
    return Line(Fraction(one.value), Fraction(two.value) - Fraction(one.value))


def _most(test: Callable[[int], bool], limit: int) -> int:
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
        way: Sequence[Configuration],
        edges: Sequence[Edge],
        slopes: Slopes,
    ) -> None:
        self._composition, self._way, self._edges = composition, way, edges
        self._slopes = slopes
        self._begin = [n for each in _flat(composition, way[0]) for n in each.numbers]
        self._length = len(edges) // 2
        pairs = [pair for at in range(self._length) for pair in self._taken(at)]
        # What a machine makes of the same it makes again.
        self._steps = [(a, b) for a, b in pairs if (a.before, a.buffers) != (b.before, b.buffers)]
        self._ticks = sum(composition.lasts[each.phase] for each in way[: self._length])

    def repeats(self) -> bool:
        """Whether the machines, apart from monitors, repeat their steps often enough."""
        return all(map(self._is_again, range(self._length))) and self._steps_last(LEAST)

    @cached_property
    def waiting(self) -> dict[int, list[m.Expr]] | None:
        """The monitors that come nearer to a deadline, with their conditions.

        None if some monitor does not only wait, and is not where it was.
        """
        watch, way = self._composition.watch, self._way
        if watch is None:
            return {}
        begin, *after = (watch.at(each.watched).states for each in way[:: self._length])
        moved = [i for i, state in enumerate(begin) if any(each[i] != state for each in after)]
        if not moved:
            return {}
        first, *others = (watch.conditions(self._seen(watch, each)) for each in way[1:])
        if any(each[index] != first[index] for each in others for index in moved):
            return None
        return {index: first[index] for index in moved}

    def _seen(self, watch: Watch, here: Configuration) -> Known:
        return watch.known(here.watched, self._composition.locals_of(here))

    def _taken(self, at: int) -> Iterator[tuple[Period, Period]]:
        return zip(self._periods(at), self._periods(at + self._length), strict=True)

    def _periods(self, at: int) -> Iterator[Period]:
        composition = self._composition
        here, there = map(composition.parts_of, self._way[at : at + 2])
        composition.deliver(composition.due[self._way[at + 1].phase], here)
        for i, move in self._edges[at].moves:
            walker = composition.walkers[i]
            before, after = (walker.locals.things[parts[i].local] for parts in (here, there))
            yield Period(walker, before, here[i].buffers, after, move)

    def edge(self) -> tuple[Configuration, Edge] | None:
        """The edge for all further repetitions, and the configuration after them."""
        edges = self._edges[: self._length]
        if not self._goes_on(LEAST):
            return None
        exact = _most(self._is_exact, LONGEST)
        if self._goes_on(exact):
            return None  # nothing turns while numbers are exact
        times = _most(self._goes_on, exact)
        landed = self._landed(times)
        if landed is None:
            return None
        there, turn = landed
        moves = tuple(move for edge in edges for move in edge.moves)
        # Two of them were taken.
        return there, Edge(-1, moves, turn=turn, loop=tuple(edges), times=times - 2)

    def _is_again(self, at: int) -> bool:
        """Whether an edge was taken again, and takes no row that could be avoided."""
        one, two = (self._edges[each] for each in (at, at + self._length))
        is_free = any(move.row >= 0 and move.free for _, move in one.moves)
        # Values that differ twice, and so are overtaken, are equal once at most.
        return not is_free and not one.turn and _bare(one) == _bare(two)

    def _is_exact(self, times: int) -> bool:
        value, slopes = self._composition.values.value, self._slopes.values
        each = zip(map(value, self._begin), slopes, strict=True)
        lines = (Line(Fraction(v.value), slope) for v, slope in each if isinstance(v, m.Number))
        return all(line.is_exact(times + 1) for line in lines if line.slope)

    def _goes_on(self, times: int) -> bool:
        """Whether so many repetitions, from the first one on, have the same steps."""
        watch, begin = self._composition.watch, self._way[0].watched
        if not self._steps_last(times):
            return False
        if watch is None:
            return True
        for index, asked in (self.waiting or {}).items():
            if times * self._ticks > watch.moving(index, watch.at(begin).states[index], asked):
                return False
        return all(
            asked == watch.conditions(_drawn(one, two, times))
            for one, two, asked in self._conditions
        )

    @cached_property
    def _conditions(self) -> list[tuple[Known, Known, list[list[m.Expr]]]]:
        """The conditions of monitors at the steps of which values differ in the next repetition."""
        watch = self._composition.watch
        if watch is None:
            return []
        seen = [self._seen(watch, each) for each in self._way]
        pairs = zip(seen[1:], seen[self._length + 1 :], strict=False)
        return [(a, b, watch.conditions(a)) for a, b in pairs if a.memory != b.memory]

    def _steps_last(self, times: int) -> bool:
        return all(_are_same(one, two, times) for one, two in self._steps)

    def _landed(self, times: int) -> tuple[Configuration, Permutation] | None:
        """The configuration after so many repetitions; None if its values are not followed."""
        composition, first = self._composition, self._way[0]
        pairs = zip(self._begin, self._slopes.values, strict=True)
        numbers = iter([composition.values.moved(n, times * slope) for n, slope in pairs])
        watch, watched = composition.watch, first.watched
        if watch is not None:
            states, seen = map(list, watch.at(watched))
            for index, asked in (self.waiting or {}).items():
                states[index] = watch.moved(index, states[index], asked, times * self._ticks)
            watched = watch.of(Watched(tuple(states), tuple(next(numbers) for _ in seen)))
        passed, parts = iter(self._slopes.clocks), list[MachineState]()
        for walker, part in zip(composition.walkers, composition.parts_of(first), strict=True):
            local: Local = walker.locals.things[part.local]
            memory = tuple(next(numbers) for _ in local.memory)
            buffers = tuple(2 * next(numbers) + number % 2 for number in part.buffers)
            pending = tuple((key, next(numbers)) for key, _ in part.pending)
            local = local._replace(clock=local.clock + times * next(passed), memory=memory)
            if not walker.follows(local, pending):
                return None
            parts.append(MachineState(walker.locals.of(local), buffers, pending))
        ordered, turn = composition.ordered(parts)
        return composition.numbered(first.phase, ordered, watched), turn


def _bare(edge: Edge) -> Edge:
    """An edge without the values that are sent, and where it leads."""
    moves = tuple((i, move._replace(sent=())) for i, move in edge.moves)
    return edge._replace(target=0, moves=moves)


def _are_same(one: Period, two: Period, times: int) -> bool:
    """Whether a step is the same on all lines that run through it and the next one."""
    walker, state, clock = one.walker, one.before.state, one.before.clock
    plain, other = (walker.before(each.before, each.buffers) for each in (one, two))
    drawn = _drawn(plain, other, times)
    now, *others = walker.clocks.after(state, clock, plain)
    if others or not walker.clocks.stays(state, drawn, now, two.before.clock - clock, times):
        return False
    asked = []
    for known in (plain, drawn):
        walker.clocks.set(known, state, now)
        axioms = [filled(axiom, known) for axiom in walker.cone.axioms]
        asked.append((axioms, list(walker.branches(state, known))))
    if asked[0] != asked[1]:
        return False
    if one.move.row >= 0:
        plain, drawn = (replace(known, periods=0, _lets={}) for known in (plain, drawn))
    target = one.move.target
    written, next_ = (dict(walker.written(target, known)) for known in (plain, drawn))
    given, then = (walker.given(each.after, each.move.sent) for each in (one, two))
    values = {key: tuple(map(walker.values.value, (given[key], then[key]))) for key in written}
    return written.keys() == next_.keys() and all(
        given[key] == then[key]
        if expr == next_[key]
        else _is_drawn(drawn, next_[key], *values[key])
        for key, expr in written.items()
    )


def _is_drawn(
    drawn: Known, expr: m.Expr, value: AbstractValue | None, then: AbstractValue | None
) -> bool:
    """Whether an expression runs on the line through two values, or is unknown as they are.

    What unknown values lie within, or which region, may change with the numbers on lines.
    """
    line = drawn.line_of(expr)
    if line is None:
        return {value, then} <= {None, SOME}
    return line == _line(value, then)


def _drawn(one: Known, two: Known, times: int) -> Known:
    """Known values in which numbers that differ later are lines."""
    memory, inputs = _lines(one.memory, two.memory), _lines(one.inputs, two.inputs)
    return replace(one, memory=memory, inputs=inputs, times=times, _lets={})


def _lines(
    one: Mapping[Key, AbstractValue], two: Mapping[Key, AbstractValue]
) -> dict[Key, AbstractValue]:
    pairs = ((key, value, two[key]) for key, value in one.items())
    return {key: a if a == b else (_line(a, b) or SOME) for key, a, b in pairs}
