"""What holds of a condition whatever the unknown parts of it are: a bound below and one above.

What is unknown may be asked otherwise, to see what a condition says without some of its parts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

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
Asks = Callable[[Expr], bool]


def surely(condition: Expr, is_unknown: Asks = has_unknown) -> Expr:
    """The condition where it holds whatever its unknown parts are."""
    return _bound(condition, FALSE, is_unknown)


def possibly(condition: Expr, is_unknown: Asks = has_unknown) -> Expr:
    """The condition where it may hold, its unknown parts permitting."""
    return _bound(condition, TRUE, is_unknown)


def _bound(expr: Expr, unknown: Expr, is_unknown: Asks) -> Expr:
    if not is_unknown(expr):
        return expr
    same = partial(_bound, unknown=unknown, is_unknown=is_unknown)
    match expr:
        case Unary(op="not", operand=operand):
            opposite = surely if unknown is TRUE else possibly
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
