"""What is certain of a machine with unknown parts."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import partial

from specc.analysis.graph import RowEdge, find_edges
from specc.model.expr import FALSE, TRUE, Choice, Expr, Logic, Quantifier, Unary, has_unknown
from specc.model.fsm import Cause, Condition, State, Transition
from specc.model.system import Subsystem
from specc.model.types import Bool
from specc.proof import InputName, Prover, RowVerdict, Witness

# What holds of a condition whatever the unknown parts of it are: a bound below and one above.
#
# What is unknown may be asked otherwise, to see what a condition says without some of its parts.


Rewriting = Callable[[Expr], Expr]
Predicate = Callable[[Expr], bool]


def must_hold_part(condition: Expr, is_unknown: Predicate = has_unknown) -> Expr:
    """The condition where it holds whatever its unknown parts are."""
    return _replace_unknown(condition, FALSE, is_unknown)


def may_hold_part(condition: Expr, is_unknown: Predicate = has_unknown) -> Expr:
    """The condition where it holds for some value of its unknown parts."""
    return _replace_unknown(condition, TRUE, is_unknown)


def _replace_unknown(expr: Expr, unknown: Expr, is_unknown: Predicate) -> Expr:
    if not is_unknown(expr):
        return expr
    same = partial(_replace_unknown, unknown=unknown, is_unknown=is_unknown)
    match expr:
        case Unary(op="not", operand=operand):
            opposite = must_hold_part if unknown is TRUE else may_hold_part
            return replace(expr, operand=opposite(operand, is_unknown))
        case Logic(operands=operands):
            return replace(expr, operands=tuple(map(same, operands)))
        case Quantifier(body=body, over=over) if not is_unknown(over):
            return replace(expr, body=same(body))
        case Choice(test=test, then=then, otherwise=otherwise):
            if not is_unknown(test):
                return replace(expr, then=same(then), otherwise=same(otherwise))
            op = "and" if unknown is FALSE else "or"
            return Logic(op, (same(then), same(otherwise)), type=Bool())  # type: ignore[arg-type]  # one of the two
    return unknown


# Machines with unknown conditions in them: the machines that they surely and possibly are.
#
# What is said of such a machine has to hold whatever the unknown is. Two rows surely overlap where
# the cause and both surely hold, and one is surely taken where it does; nothing applies where the
# cause surely holds and no row possibly does; nothing ever applies where nothing possibly does.


@dataclass(frozen=True, slots=True)
class Approximation:
    """An approximation of a machine with unknowns, from below or above."""

    cause: Cause
    ends: Rewriting
    rows: Rewriting

    def of(self, subsystem: Subsystem) -> Subsystem:
        """The machine without unknowns; of its behaviours only the end by the cause counts."""
        states = tuple(self._state(state) for state in subsystem.states)
        rows = tuple(
            replace(row, condition=_known(row.condition, self.rows))
            for row in subsystem.transitions
        )
        return replace(subsystem, states=states, transitions=rows)

    def _state(self, state: State) -> State:
        behaviour = state.behaviour
        # An error goes before an end: where it is not known, the end is not known either.
        opposite = may_hold_part if self.ends is must_hold_part else must_hold_part
        errors = tuple(
            (cause, _known(error, self.ends if self.cause == cause else opposite))
            for cause, error in behaviour.errors
        )
        terminal = _known(behaviour.terminal, self.ends)
        approximated = replace(behaviour, terminal=terminal, errors=errors)
        return replace(state, behaviour=approximated)


def must_view(cause: Cause) -> Approximation:
    """Ends and rows that surely hold."""
    return Approximation(cause, must_hold_part, must_hold_part)


def gap_view(cause: Cause) -> Approximation:
    """Ends that surely hold, with rows that may hold.

    Where no row of this view applies, there surely is a gap.
    """
    return Approximation(cause, must_hold_part, may_hold_part)


def may_view(cause: Cause) -> Approximation:
    """Ends and rows that may hold."""
    return Approximation(cause, may_hold_part, may_hold_part)


def is_incomplete(subsystem: Subsystem, state: State, cause: Cause) -> bool:
    """Whether something about the rows of a state and cause is unknown."""
    rows = (row.condition.when for _, row in subsystem.rows(state.name, cause))
    return any(map(has_unknown, (*(when for when, _ in state.behaviour.facts_after(cause)), *rows)))


def _known(condition: Condition, bound: Rewriting) -> Condition:
    return replace(condition, when=bound(condition.when))


# What is decided of a machine with unknown conditions in it, whatever these are.


class MustMayAnalysis:
    """Verdicts about a subsystem with unknowns, from its approximations."""

    def __init__(self, subsystem: Subsystem, prover: Callable[[Subsystem], Prover]) -> None:
        """`prover` makes one for a subsystem without unknowns."""
        self._subsystem = subsystem
        self._new = prover
        self._provers: dict[Approximation, Prover] = {}

    def verdict(
        self, state: str, cause: Cause, present: Collection[InputName]
    ) -> RowVerdict | None:
        """The certain verdict about the rows; None if it is unknown whether the cause occurs."""
        known, gaps, all_ = (
            self._prover(view(cause)).prove_rows(state, cause, present=present).decision
            for view in (must_view, gap_view, may_view)
        )
        if known.possible != all_.possible:
            return None
        decision = replace(all_, gap=gaps.gap, overlap=known.overlap, unknown="", open=None)
        return RowVerdict(_rows(self._subsystem, state, cause), decision)

    def overlap(
        self, state: str, cause: Cause, pair: tuple[int, int], present: Collection[InputName]
    ) -> Witness | None:
        """Where two rows of a state and cause, by their indices, surely apply together."""
        known = must_view(cause).of(self._subsystem)
        rows = _rows(known, state, cause)
        two = replace(known, transitions=tuple(rows[index] for index in pair))
        return self._new(two).prove_rows(state, cause, present=present).decision.overlap

    def edges(self) -> tuple[RowEdge, ...]:
        """The rows that may be taken whatever is unknown."""
        verdicts = []
        for state in self._subsystem.states:
            for cause in state.behaviour.causes:
                decision = self._prover(must_view(cause)).prove_rows(state.name, cause).decision
                verdicts.append(RowVerdict(_rows(self._subsystem, state.name, cause), decision))
        return find_edges(self._subsystem, verdicts)

    def _prover(self, view: Approximation) -> Prover:
        if view not in self._provers:
            self._provers[view] = self._new(view.of(self._subsystem))
        return self._provers[view]


def _rows(subsystem: Subsystem, state: str, cause: Cause) -> tuple[Transition, ...]:
    return tuple(row for _, row in subsystem.rows(state, cause))
