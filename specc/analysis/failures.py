"""Arithmetic that has no result, whatever else is computed with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

from specc.lang.builtins import FUNCTIONS
from specc.lang.signs import SIGNS
from specc.limits import TooMuchError
from specc.model.expr import Binary, Builtin, Choice, Expr, Logic, Quantifier, children


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
    known = [value(part) for part in children(expr)]
    match expr:
        case Binary(op=op) if SIGNS[op].may_fail:
            compute = SIGNS[op].value
            if op == "/" and known[0] is None:
                known[0] = 1.0  # whatever it is, only a divisor of zero fails
        case Builtin(name=name) if FUNCTIONS[name].may_fail and FUNCTIONS[name].is_foldable:
            compute = FUNCTIONS[name].value
        case _:
            return ""
    if None in known:
        return ""
    try:
        compute(*known)
    except (ArithmeticError, ValueError) as error:
        return no_value(error)
    return ""


Answer = Literal["yes", "no", "some", "settled"]
"""Whether a condition holds: always, never, at times, or as constants say that are not known."""


def is_asked(whole: Expr, part: Expr, answer: Callable[[Expr], Answer]) -> bool:
    """Whether no constant leaves a part of an expression out, and nothing goes over no item."""
    if whole is part:
        return True
    return any(is_asked(each, part, answer) for each in asked_parts(whole, answer))


def asked_parts(whole: Expr, answer: Callable[[Expr], Answer]) -> Iterator[Expr]:
    """The parts of an expression that some step computes; of "settled" answers nothing is sure."""
    match whole:
        case Choice(test=test, then=then, otherwise=otherwise):
            yield test
            said = answer(test)
            if said in ("yes", "some"):
                yield then
            if said in ("no", "some"):
                yield otherwise
        case Logic(op=op, operands=operands):
            goes_on = "yes" if op == "and" else "no"
            for operand in operands:
                yield operand
                if answer(operand) not in (goes_on, "some"):
                    return
        case Quantifier(over=over):
            yield over
        case _:
            yield from children(whole)
