"""What holds of a condition whatever the unknown parts of it are: a bound below and one above."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from specc.model.expr import (
    FALSE,
    TRUE,
    Choice,
    Expr,
    Logic,
    Quantifier,
    Unary,
    has_unknown,
)
from specc.model.types import Bool

Bound = Callable[[Expr], Expr]


def surely(condition: Expr) -> Expr:
    """The condition where it holds whatever its unknown parts are."""
    return _bound(condition, surely, possibly, FALSE)


def possibly(condition: Expr) -> Expr:
    """The condition where it may hold, its unknown parts permitting."""
    return _bound(condition, possibly, surely, TRUE)


def _bound(expr: Expr, same: Bound, opposite: Bound, unknown: Expr) -> Expr:
    if not has_unknown(expr):
        return expr
    match expr:
        case Unary(op="not", operand=operand):
            return replace(expr, operand=opposite(operand))
        case Logic(operands=operands):
            return replace(expr, operands=tuple(map(same, operands)))
        case Quantifier(body=body, over=over) if not has_unknown(over):
            return replace(expr, body=same(body))
        case Choice(test=test, then=then, otherwise=otherwise):
            if not has_unknown(test):
                return replace(expr, then=same(then), otherwise=same(otherwise))
            op = "and" if unknown is FALSE else "or"
            return Logic(op, (same(then), same(otherwise)), type=Bool())  # type: ignore[arg-type]  # one of the two
    return unknown
