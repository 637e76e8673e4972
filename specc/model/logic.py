"""Conditions that are made of conditions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Literal

from specc.model.expr import FALSE, OPPOSITES, TRUE, Compare, Expr, Logic, Truth, Unary
from specc.model.types import Bool


def truth(value: bool) -> Truth:
    """The condition that always, or never, holds."""
    return TRUE if value else FALSE


def negation(condition: Expr) -> Expr:
    """`not condition`."""
    match condition:
        case Truth(value=value):
            return truth(not value)
        case Unary(op="not", operand=operand):
            return operand
    return Unary("not", condition, type=Bool())


def opposite(condition: Expr) -> Expr:
    """The negation of a condition as one would write it."""
    if isinstance(condition, Compare):
        op = OPPOSITES[condition.op]
        return Compare(op, condition.left, condition.right, type=Bool())  # type: ignore[arg-type]  # one of six
    return negation(condition)


def junction(op: Literal["and", "or"], parts: Sequence[Expr]) -> Expr:
    """The conjunction or disjunction of some conditions."""
    if len(parts) < 2:
        return parts[0] if parts else truth(op == "and")
    return Logic(op, tuple(parts), type=Bool())


def conjuncts(condition: Expr) -> Iterator[Expr]:
    """The operands of a conjunction, or the negated operands of a negated disjunction."""
    match condition:
        case Logic(op="and", operands=operands):
            yield from _conjuncts_of(operands)
        case Unary(op="not", operand=Logic(op="or", operands=operands)):
            yield from _conjuncts_of(map(negation, operands))
        case _:
            yield condition


def _conjuncts_of(operands: Iterable[Expr]) -> Iterator[Expr]:
    for operand in operands:
        yield from conjuncts(operand)
