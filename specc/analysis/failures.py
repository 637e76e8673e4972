"""Arithmetic that has no result, whatever else is computed with it."""

from __future__ import annotations

from collections.abc import Callable

from specc.lang.builtins import FUNCTIONS
from specc.lang.signs import SIGNS
from specc.limits import TooMuchError
from specc.model.expr import Binary, Builtin, Choice, Expr, Logic, children


def no_value(error: Exception) -> str:
    """Why arithmetic has no result."""
    match error:
        case TooMuchError():
            return str(error)
        case OverflowError():
            return "it is too large"
        case ZeroDivisionError():
            return "it divides by zero"
    return "it takes a root of a negative number" if "domain" in str(error) else str(error)


def failure(expr: Expr, value: Callable[[Expr], float | None]) -> str:
    """Why an operation has no result; "" if it may have one.

    `value` gives the number that a part is, None if it is not known.
    """
    match expr:
        case Binary(op=op) if SIGNS[op].may_fail:
            compute = SIGNS[op].value
        case Builtin(name=name) if FUNCTIONS[name].may_fail and FUNCTIONS[name].folds:
            compute = FUNCTIONS[name].value
        case _:
            return ""
    known = [value(part) for part in children(expr)]
    if isinstance(expr, Binary) and known[0] is None:
        known[0] = 1.0  # only zero divides no number
    if None in known:
        return ""
    try:
        compute(*known)
    except (ArithmeticError, ValueError) as error:
        return no_value(error)
    return ""


def is_asked(whole: Expr, part: Expr, truth: Callable[[Expr], bool | None]) -> bool:
    """Whether a part of an expression is not left out for sure; `truth` is that of conditions."""
    if whole is part:
        return True
    asked = children(whole)
    match whole:
        case Choice(test=test, then=then, otherwise=otherwise):
            taken = truth(test)
            asked = [test, *[then] * (taken is not False), *[otherwise] * (taken is not True)]
        case Logic(op=op):
            decided = [truth(each) is (op == "or") for each in asked]
            asked = asked[: decided.index(True) + 1] if True in decided else asked
    return any(is_asked(each, part, truth) for each in asked)
