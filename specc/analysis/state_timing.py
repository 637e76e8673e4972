"""How long states can last: what ends them for certain, and what comes too late for that."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import compress

from specc.analysis.graph import CAUSES
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
    """`condition` could hold in a state only after the state is `over` by its other conditions.

    `row` is the row that asks it, if it is an initial condition; `ended_by` end the state by then,
    and `timed` says whether they speak of time.
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

    `by` says whether the error ends it then, and whether the terminal condition does; `in_time`
    says of each cause whether it ends the state by that time.
    """

    end_s: Fraction
    by: tuple[bool, bool]
    in_time: dict[Cause, list[Expr]]


class StateTiming:
    """Asks about the states of one subsystem that has no unknowns."""

    def __init__(
        self,
        subsystem: Subsystem,
        prover: Prover,
        dependences: Dependences,
        verdict: Callable[[str, Cause], RowVerdict],
    ) -> None:
        """`verdict` says what is decided about the rows of a state and cause."""
        self._subsystem = subsystem
        self._prover = prover
        self._dependences = dependences
        self._verdict = verdict
        self._parameters = {constant.name for constant in subsystem.constants}
        self._endings: dict[tuple[int, int], _Ending | None] = {}
        self._excluded: dict[tuple[int, Cause, int], bool] = {}

    def never_ends(self, state: State, cause: Cause) -> bool:
        """Whether time makes a condition that ends a state false for ever before it can hold."""
        end = state.behaviour.ending(cause)
        return any(exit.row is None and exit.condition is end for exit in self.overdue_exits(state))

    def is_one_period(self, state: State) -> bool:
        """Whether a state surely ends in its second period, when its conditions are first asked."""
        ending = self._ending(state.behaviour)
        return ending is not None and ending.end_s == 1 / self._subsystem.rate_hz

    def overdue_exits(self, state: State) -> Iterator[OverdueExit]:
        """The conditions that time makes false for ever in a state before they can hold."""
        if not self._timed_conditions:
            return
        behaviour = state.behaviour
        conditions = [behaviour.error, behaviour.terminal]
        rows = (self._subsystem.rows(state.name, cause) for cause in CAUSES)
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
        """The texts of conditions in which time alone turns something, by identity."""
        conditions = self._subsystem.exit_conditions
        return {
            id(each.when) for each in conditions if self._prover.timer.turning_periods(each.when)
        }

    def _excludes(self, ending: _Ending, cause: Cause, initial: Condition | None) -> bool:
        """Whether a state cannot end by a cause, and with a condition, before it is over."""
        key = id(ending), cause, id(initial)
        if key not in self._excluded:
            context = [*ending.in_time[cause], *([initial.when] if initial else [])]
            self._excluded[key] = self._prover.satisfiable(context) is False
        return self._excluded[key]

    def excludes_row(self, row: Transition) -> bool:
        """Whether a row that is never taken is never taken because of conditions on time."""
        source = self._subsystem.state(row.source).behaviour
        return self.is_time_the_cause(
            *as_conditions(source.facts_after(row.cause)), row.condition.when
        )

    def is_time_the_cause(self, *conditions: Expr) -> bool:
        """Whether conditions that never hold together could, but for what they say of time."""
        timeless = [may_hold_part(condition, self._is_timed) for condition in conditions]
        return any(map(self._is_timed, conditions)) and self._prover.satisfiable(timeless) is True

    def _is_timed(self, expr: Expr) -> bool:
        return self._dependences.of(expr).has_clock or has_unknown(expr)

    def _ending(self, behaviour: Behaviour) -> _Ending | None:
        """How states end that end by the same conditions, if no parameter decides it."""
        ends = behaviour.error.when, behaviour.terminal.when
        key = id(ends[0]), id(ends[1])
        if key not in self._endings:
            given = self._dependences.all(ends).constants & self._parameters
            self._endings[key] = None if given else self._found(behaviour)
        return self._endings[key]

    def _found(self, behaviour: Behaviour) -> _Ending | None:
        error, terminal = behaviour.error, behaviour.terminal
        either = junction("or", (error.when, terminal.when))
        for periods in sorted(
            {1, *sorted(self._prover.timer.turning_periods(either))[:_MOST_TURNS]}
        ):
            now = self._prover.timer.elapsed_condition("==", periods)
            if self._prover.implies([now], either):
                by_error = self._prover.implies([now], error.when)
                by_terminal = not by_error and self._prover.implies([now], terminal.when)
                by_then = self._prover.timer.elapsed_condition("<=", periods)
                return _Ending(
                    periods / self._subsystem.rate_hz,
                    (not by_terminal, not by_error),
                    {
                        cause: [*as_conditions(behaviour.facts_after(cause)), by_then]
                        for cause in CAUSES
                    },
                )
        return None
