"""Time in states and modes: counted, or in classes between periods at which a condition turns."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple

from specc.model import expr as m
from specc.model.types import Bool
from specc.proof import InputName
from specc.proof.clock import Timer, TurningPoints
from specc.proof.numbering import Numbering
from specc.tools.explore.cone import Cone
from specc.tools.explore.partial import AbstractValue, KnownValues, residual

MOST_COUNTED = 10_000
"""Periods up to which a comparison of time with tracked values is computed."""


class TurnTable(NamedTuple):
    """When conditions turn, by identity (`Known.turns`), and the periods at which any does."""

    turns: dict[int, tuple[m.Expr, TurningPoints]]
    at: tuple[int, ...]


_Compared = tuple[tuple[m.Expr, ...], list[InputName], list[str]]
"""Comparisons of time with tracked values, and the inputs and memory that they read."""


class Clocks:
    """The clock of one machine.

    If it `counts_periods` (up to the last turn), it is twice their number, plus 1 where more may
    have passed. Otherwise it is a class: how many of the turns have passed that are the same at all
    times.
    """

    def __init__(self, cone: Cone, static: KnownValues, *, counts_periods: bool) -> None:
        """`static` are the values known at all times; turns that are found are added to it."""
        self.counts_periods = counts_periods
        self._dependences, self._static = cone.dependences, static
        self._tracked = {x.key for x in cone.inputs if x.is_tracked}
        # All constants have values here, those too that no proof computes.
        self._timer = Timer(Numbering(static.lets, static.constants, static.period_s))
        self._turns: dict[str, tuple[int, ...]] = {}
        self._compared: dict[str, _Compared] = {}
        for state in cone.states:
            exprs = [value for _, value in state.assignments]
            exprs += [*cone.axioms, *state.conditions]
            turning = set[int]()
            for decided in map(self._timer.timed_conditions, exprs):
                static.turns |= decided
                turning.update(*(turns.at for _, turns in decided.values()))
            self._turns[state.name] = tuple(sorted(turning))
            found = tuple(self._time_comparisons(exprs))
            rests = cone.dependences.all(found)
            self._compared[state.name] = found, sorted(rests.values), sorted(rests.memory)
        self._turn_tables: dict[tuple[str, tuple[AbstractValue | None, ...]], TurnTable] = {}

    @property
    def is_timed(self) -> bool:
        """Whether a condition depends on the time in a state."""
        return any(self._turns.values()) or any(found for found, *_ in self._compared.values())

    # When conditions turn.

    def _turn_table(self, state: str, known: KnownValues) -> TurnTable:
        """When the conditions of a state turn, with the values that time is compared with."""
        compared, inputs, memory = self._compared[state]
        values = (*map(known.inputs.get, inputs), *map(known.memory.get, memory))
        if (state, values) not in self._turn_tables:
            self._turn_tables[state, values] = self._find_turns(state, compared, known)
        return self._turn_tables[state, values]

    def _find_turns(self, state: str, compared: Iterable[m.Expr], known: KnownValues) -> TurnTable:
        values = replace(self._static, inputs=known.inputs, memory=known.memory, _residuals={})
        found, at = dict(self._static.turns), {1, *self._turns[state]}
        for expr in compared:
            turns = self._timer.turning_points(residual(expr, values))
            if turns is not None and max(turns.at, default=0) <= MOST_COUNTED:
                found[id(expr)] = expr, turns
                at.update(turns.at)
        return TurnTable(found, tuple(sorted(at)))

    def _time_comparisons(self, exprs: Iterable[m.Expr]) -> list[m.Expr]:
        """The comparisons of time with tracked values, directly or through lets; each once."""
        parts = {id(expr): expr for expr in exprs}
        found, waiting = list[m.Expr](), list(parts.values())
        while waiting:
            expr = waiting.pop()
            rests = self._dependences.of(expr)
            if not rests.has_clock or id(expr) in self._static.turns:
                continue
            if isinstance(expr, m.Compare):
                if rests.values <= self._tracked and rests.values | rests.memory:
                    found.append(expr)
                continue
            named = [self._static.lets[expr.name]] if isinstance(expr, m.LetRef) else []
            new = [part for part in (*named, *m.children(expr)) if id(part) not in parts]
            parts.update((id(part), part) for part in new)
            waiting += new
        return found

    # The clock.

    def initial(self, state: str) -> int:
        """The clock of a state just entered; with classes, the class of one period later."""
        return 0 if self.counts_periods else sum(turn <= 1 for turn in self._turns[state])

    def next_clocks(self, state: str, clock: int, known: KnownValues) -> tuple[int, ...]:
        """The possible clocks at the next time stamp, with the values known then."""
        if not self.counts_periods:
            return tuple(range(clock, len(self._turns[state]) + 1))
        last = self._turn_table(state, known).at[-1]
        passed, more = clock // 2 + 1, clock % 2
        if passed >= last:
            return (2 * last + 1,)
        if not more:
            return (2 * passed,)
        # Compared with other values, more had passed: any of these numbers.
        return (*range(2 * passed, 2 * last, 2), 2 * last + 1)

    def turns_passed(self, state: str, clock: int, known: KnownValues) -> int:
        """How many times conditions have turned, which decides all that depends on the clock."""
        return (
            bisect(self._turn_table(state, known).at, clock // 2) if self.counts_periods else clock
        )

    def set_time(self, known: KnownValues, state: str, clock: int) -> None:
        """Set the time in a state in the known values."""
        known._residuals.clear()
        if self.counts_periods:
            known.turns, known.periods = self._turn_table(state, known).turns, clock // 2
        else:  # a class counts the turns that passed
            known.periods = self._turns[state][clock - 1] if clock else 1


@dataclass(frozen=True, slots=True)
class ModeTimer:
    """The periods that passed in a mode, where only conditions that turn with them read them.

    If it `counts`, all periods up to the last of the `turns` are told apart. Otherwise the first
    period from a turn on stands for all until the next turn.
    """

    turns: tuple[int, ...]
    counts: bool

    def numbers(self, periods: int) -> tuple[int, ...]:
        """The numbers that stand for one period more than what `periods - 1` stands for."""
        if self.counts:
            return (min(periods, self.turns[-1]),)
        after = bisect(self.turns, periods)
        first = self.turns[after - 1]
        return (first,) if first == periods else (first, *self.turns[after : after + 1])


def mode_timers(cone: Cone, static: KnownValues, *, counts: bool) -> dict[str, ModeTimer]:
    """The memory that counts periods of modes and is read by conditions that time alone decides."""
    found = {}
    numbering = Numbering(static.lets, static.constants, static.period_s)
    for item in cone.memory:
        turns = _mode_turns(cone, static, item.name, numbering) if item.is_timer else None
        if turns is not None:
            found[item.name] = ModeTimer(tuple(sorted(turns)), counts)
    return found


def _mode_turns(
    cone: Cone, static: KnownValues, name: str, numbering: Numbering
) -> set[int] | None:
    """The periods of a mode at which conditions turn; None if something else reads them."""
    timer, found = Timer(numbering, name), {0, 1}
    waiting = [*cone.axioms, *(item.init for item in cone.memory)]
    for state in cone.states:
        waiting += [*state.conditions, *state.failing]
        waiting += (value for key, value in state.assignments if key != ("", name))
    while waiting:
        expr = waiting.pop()
        if name not in cone.dependences.of(expr).memory:
            continue
        turns = timer.turning_points(expr) if isinstance(expr.type, Bool) else None
        if turns is not None:
            found.update(turns.at)
        elif isinstance(expr, m.MemoryRef):
            return None
        else:
            waiting += [static.lets[expr.name]] if isinstance(expr, m.LetRef) else []
            waiting += m.children(expr)
    return found
