"""How long states can last: what ends them for certain, and what comes too late for that."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from specc.analysis.graph import CAUSES
from specc.analysis.needs import Needs
from specc.analysis.presence import names_any
from specc.analysis.vague import possibly
from specc.model.expr import (
    Clock,
    Compare,
    Expr,
    LetRef,
    Logic,
    Number,
    Unary,
    children,
    has_unknown,
)
from specc.model.fsm import Cause, Condition, State, Transition
from specc.model.system import Subsystem
from specc.model.types import Bool, Real
from specc.model.units import SECOND

if TYPE_CHECKING:
    from specc.analysis.facts import Facts

_ELAPSED = Clock("elapsed", type=Real(SECOND))
_LONGEST_S = 1e6
_MOST_TIMES = 12
"""Times of one state at which it is asked whether it is over."""


class Late(NamedTuple):
    """`condition` could hold in a state only after the state is `over` by its other conditions.

    `row` is the row that asks it, if it is an initial condition; `ended_by` end the state by then,
    and `timed` says whether they speak of time.
    """

    state: State
    condition: Condition
    row: Transition | None
    over_s: Fraction
    ended_by: tuple[Condition, ...]
    timed: bool


class Lasting:
    """Asks about the states of one subsystem that has no unknowns."""

    def __init__(self, subsystem: Subsystem, facts: Facts) -> None:
        self._subsystem = subsystem
        self._facts = facts
        self._prover = facts.prover(subsystem)
        self._parameters = {constant.name for constant in subsystem.constants}
        self._lets = {item.name: item.value for item in subsystem.lets}
        self._needs = Needs(subsystem)

    def never_ends(self, state: State, cause: Cause) -> bool:
        """Whether time makes a condition that ends a state false for ever before it can hold."""
        behaviour = state.behaviour
        condition = behaviour.error if cause == "error" else behaviour.terminal
        return any(late.row is None and late.condition is condition for late in self.late(state))

    def late(self, state: State) -> Iterator[Late]:
        """The conditions that time makes false for ever in a state before they can hold."""
        behaviour = state.behaviour
        rows = [row for _, row in self._rows(state)]
        ends = (behaviour.error, behaviour.terminal)
        asked = [*ends, *(row.condition for row in rows)]
        if not any(self._times(condition.when) for condition in asked):
            return
        if any(names_any(condition.when, self._parameters) for condition in ends):
            return
        over = self._over(state)
        if over is None:
            return
        over_s, ended_by = over
        timed = any(self._times(condition.when) for condition in ended_by)
        by_then = Compare("<=", _ELAPSED, _seconds(over_s), type=Bool())
        for cause, condition in zip(CAUSES[::-1], ends, strict=True):
            verdict = self._facts.verdict(self._subsystem, state.name, cause)
            if not verdict.decision.possible:
                continue
            context = [*ended(state, cause), by_then]
            if self._prover.satisfiable(context) is False:
                yield Late(state, condition, None, over_s, ended_by, timed)
                continue
            for row, possible in zip(verdict.rows, verdict.decision.satisfiable, strict=True):
                when = row.condition.when
                if possible and self._prover.satisfiable([*context, when]) is False:
                    yield Late(state, row.condition, row, over_s, ended_by, timed)

    def excludes(self, row: Transition) -> bool:
        """Whether what is said of time is why a row is never taken, if it is never taken."""
        source = self._subsystem.state(row.source)
        return self.is_why(*ended(source, row.cause), row.condition.when)

    def is_why(self, *conditions: Expr) -> bool:
        """Whether conditions that never hold together could, but for what they say of time."""
        timeless = [possibly(condition, self._is_timed) for condition in conditions]
        return any(map(self._is_timed, conditions)) and self._prover.satisfiable(timeless) is True

    def _is_timed(self, expr: Expr) -> bool:
        return self._needs.sources(expr).clock or has_unknown(expr)

    def _rows(self, state: State) -> Iterator[tuple[Cause, Transition]]:
        for cause in CAUSES:
            for _, row in self._subsystem.rows(state.name, cause):
                yield cause, row

    def _over(self, state: State) -> tuple[Fraction, tuple[Condition, ...]] | None:
        """The time at which a state surely ends, if it has not before, and what ends it then."""
        error, terminal = state.behaviour.error, state.behaviour.terminal
        either = Logic("or", (error.when, terminal.when), type=Bool())
        for time_s in self._candidates(either):
            now = Compare("==", _ELAPSED, _seconds(time_s), type=Bool())
            if self._prover.implies([now], either):
                for condition in (error, terminal):
                    if self._prover.implies([now], condition.when):
                        return time_s, (condition,)
                return time_s, (error, terminal)
        return None

    def _candidates(self, ends: Expr) -> list[Fraction]:
        """The first period, and those about each time that the ends of a state speak of."""
        period_s = 1 / self._subsystem.rate_hz
        counts = {1}
        for time_s in sorted(self._times(ends))[:_MOST_TIMES]:
            nearest = round(Fraction(time_s) / period_s)
            counts |= {nearest - 1, nearest, nearest + 1}
        return [count * period_s for count in sorted(counts) if count > 0]

    def _times(self, expr: Expr, seen: frozenset[str] = frozenset()) -> set[float]:
        """The times that `elapsed` is compared with, in seconds."""
        found: set[float] = set()
        open_, met = [expr], set(seen)
        numbering = self._prover.numbering
        while open_:
            node = open_.pop()
            if isinstance(node, LetRef) and node.name in self._lets and node.name not in met:
                met.add(node.name)
                open_.append(self._lets[node.name])
            if isinstance(node, Compare):
                sides = [numbering.looked_through(side) for side in (node.left, node.right)]
                for side, other in (sides, sides[::-1]):
                    time_s = _time(numbering.value(numbering.number(other)))
                    if isinstance(side, Clock) and side.name == "elapsed" and time_s is not None:
                        found.add(time_s)
            open_ += children(node)
        return found


def _time(value: object) -> float | None:
    """A number that may be a time in a state, in seconds."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return None
    return float(value) if 0 <= value < _LONGEST_S else None


def _seconds(time_s: Fraction) -> Number:
    return Number(float(time_s), type=Real(SECOND))


def ended(state: State, cause: Cause) -> list[Expr]:
    """When a state ends by a cause: an error goes before."""
    error, terminal = state.behaviour.error.when, state.behaviour.terminal.when
    return [error] if cause == "error" else [terminal, Unary("not", error, type=Bool())]
