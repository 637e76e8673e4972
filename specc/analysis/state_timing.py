"""Timing of states: when they surely end, and which exits are overdue."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import compress

from specc.analysis.must_may import may_hold_part
from specc.analysis.path_conditions import as_conditions
from specc.analysis.reads import Dependences
from specc.model.expr import Expr, has_unknown, junction
from specc.model.fsm import Behaviour, Cause, Condition, State, Transition
from specc.model.system import Subsystem
from specc.proof import Prover, RowVerdict

_MOST_TURNS = 24
"""Most periods of one state in which it is checked whether it has ended."""


@dataclass(frozen=True, slots=True)
class OverdueExit:
    """A `condition` of a state that could hold only after other conditions have ended the state.

    `row` is its row, if it is an initial condition. The conditions `ended_by` end the state at
    `end_s`; `is_timed` says whether they depend on time.
    """

    state: State
    condition: Condition
    row: Transition | None
    end_s: Fraction
    ended_by: tuple[Condition, ...]
    is_timed: bool


@dataclass(frozen=True, slots=True)
class _Ending:
    """The time at which a state surely ends, if it has not before.

    `by` says which of its conditions, in order of priority, may end it then. `in_time` has, for
    each cause, the conditions under which it ends the state by that time.
    """

    end_s: Fraction
    by: tuple[bool, ...]
    in_time: dict[Cause, list[Expr]]


class StateTiming:
    """Timing of the states of one subsystem without unknowns."""

    def __init__(
        self,
        subsystem: Subsystem,
        prover: Prover,
        dependences: Dependences,
        verdict: Callable[[str, Cause], RowVerdict],
    ) -> None:
        """`verdict` gives that about the rows of a state and cause."""
        self._subsystem = subsystem
        self._prover = prover
        self._dependences = dependences
        self._verdict = verdict
        self._parameters = {constant.name for constant in subsystem.constants}
        self._endings: dict[tuple[tuple[Cause, int], ...], _Ending | None] = {}
        self._excluded: dict[tuple[int, Cause, int], bool] = {}

    def never_ends(self, state: State, cause: Cause) -> bool:
        """Whether a state is surely over before a cause can end it."""
        end = state.behaviour.ending(cause)
        return any(exit.row is None and exit.condition is end for exit in self.overdue_exits(state))

    def is_one_period(self, state: State) -> bool:
        """Whether a state surely ends when its conditions are first evaluated."""
        ending = self._ending(state.behaviour)
        return ending is not None and ending.end_s == 1 / self._subsystem.rate_hz

    def overdue_exits(self, state: State) -> Iterator[OverdueExit]:
        """The conditions of a state that can hold only after it is over."""
        if not self._timed_conditions:
            return
        behaviour = state.behaviour
        conditions = [condition for _, condition in behaviour.endings]
        rows = (self._subsystem.rows(state.name, cause) for cause in behaviour.causes)
        evaluated = (*conditions, *(row.condition for of_cause in rows for _, row in of_cause))
        if self._timed_conditions.isdisjoint([id(condition.when) for condition in evaluated]):
            return
        ending = self._ending(behaviour)
        if ending is None:
            return
        ended_by = tuple(compress(conditions, ending.by))
        end = (
            ending.end_s,
            ended_by,
            any(self._prover.timer.turning_periods(end.when) for end in ended_by),
        )
        for cause, condition in behaviour.endings:
            verdict = self._verdict(state.name, cause)
            if not verdict.decision.possible:
                continue
            if self._excludes(ending, cause, None):
                yield OverdueExit(state, condition, None, *end)
                continue
            for row, possible in zip(verdict.rows, verdict.decision.satisfiable, strict=True):
                if possible and self._excludes(ending, cause, row.condition):
                    yield OverdueExit(state, row.condition, row, *end)

    @cached_property
    def _timed_conditions(self) -> set[int]:
        """The conditions with a part that time alone decides, by identity."""
        conditions = self._subsystem.exit_conditions
        return {
            id(each.when) for each in conditions if self._prover.timer.turning_periods(each.when)
        }

    def _excludes(self, ending: _Ending, cause: Cause, initial: Condition | None) -> bool:
        """Whether a state is over before a cause can end it with an initial condition."""
        key = id(ending), cause, id(initial)
        if key not in self._excluded:
            context = [*ending.in_time[cause], *([initial.when] if initial else [])]
            self._excluded[key] = self._prover.satisfiable(context) is False
        return self._excluded[key]

    def excludes_row(self, row: Transition) -> bool:
        """Whether a row is never taken because of conditions on time."""
        source = self._subsystem.state(row.source).behaviour
        return self.is_time_the_cause(
            *as_conditions(source.facts_after(row.cause)), row.condition.when
        )

    def is_time_the_cause(self, *conditions: Expr) -> bool:
        """Whether conditions that exclude each other could hold together without their times."""
        timeless = [may_hold_part(condition, self._is_timed) for condition in conditions]
        return any(map(self._is_timed, conditions)) and self._prover.satisfiable(timeless) is True

    def _is_timed(self, expr: Expr) -> bool:
        return self._dependences.of(expr).has_clock or has_unknown(expr)

    def _ending(self, behaviour: Behaviour) -> _Ending | None:
        """The end of states with the same causes and conditions, unless a parameter decides it."""
        ends = [condition.when for _, condition in behaviour.endings]
        key = tuple((cause, id(condition.when)) for cause, condition in behaviour.endings)
        if key not in self._endings:
            given = self._dependences.all(ends).constants & self._parameters
            self._endings[key] = None if given else self._found(behaviour)
        return self._endings[key]

    def _found(self, behaviour: Behaviour) -> _Ending | None:
        ends = [condition.when for _, condition in behaviour.endings]
        either = junction("or", ends)
        for periods in sorted(
            {1, *sorted(self._prover.timer.turning_periods(either))[:_MOST_TURNS]}
        ):
            now = self._prover.timer.elapsed_condition("==", periods)
            if self._prover.implies([now], either):
                surely = (self._prover.implies([now], end) is True for end in ends)
                first = next((index for index, ends_it in enumerate(surely) if ends_it), -1)
                by_then = self._prover.timer.elapsed_condition("<=", periods)
                return _Ending(
                    periods / self._subsystem.rate_hz,
                    tuple(first in (index, -1) for index in range(len(ends))),
                    {
                        cause: [*as_conditions(behaviour.facts_after(cause)), by_then]
                        for cause in behaviour.causes
                    },
                )
        return None
