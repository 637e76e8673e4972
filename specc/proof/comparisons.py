"""Comparisons of numbers as questions about a quantity, so that thresholds are in order."""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import partial

from specc.model.expr import Binary, Builtin, Clock, Expr, Number, Unary
from specc.model.types import Int, ListOf
from specc.proof.formula import Apart, Quantity, Threshold
from specc.proof.numbering import Depths, Numbering, Scalar

_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}
# The question that decides a comparison, and the answer with which the comparison holds.
_QUESTIONS: dict[str, tuple[str, bool]] = {
    "<": ("<", True),
    "<=": ("<=", True),
    "==": ("==", True),
    ">": ("<=", False),
    ">=": ("<", False),
    "!=": ("==", False),
}
_COMPUTED = {
    "<": operator.lt,
    "<=": operator.le,
    "==": operator.eq,
    ">": operator.gt,
    ">=": operator.ge,
    "!=": operator.ne,
}
_NEVER_NEGATIVE = ("abs", "norm", "sqrt")

Question = tuple[Quantity, Threshold, bool]
Near = tuple[Quantity | Apart, object]


class Comparisons:
    """Makes quantities of the numbers that are compared in one subsystem."""

    def __init__(self, numbering: Numbering) -> None:
        self._numbering = numbering

    def question(self, op: str, left: Expr, right: Expr, bound: Depths) -> Question | bool:
        """Quantity, question and the answer with which `left op right`; or its known truth."""
        a, b = self._numbering.number(left, bound), self._numbering.number(right, bound)
        x, y = _as_number(self._numbering.value(a)), _as_number(self._numbering.value(b))
        if x is not None and y is not None:
            return bool(_COMPUTED[op](x, y))
        if a == b:
            return bool(_COMPUTED[op](0, 0))
        if x is not None or (y is None and a > b):
            left, right, a, b, y, op = right, left, b, a, x, _MIRRORED[op]
        if y is not None and isinstance(left, Unary):
            return self.question(_MIRRORED[op], left.operand, _negative(right), bound)
        whole = isinstance(left.type, Int)
        if y is None:
            whole = whole and isinstance(right.type, Int)
            quantity, y = Quantity("difference", (a, b), whole, None), 0.0
        else:
            lowest = least(left, partial(self._numbering.number, bound=bound))
            quantity = Quantity("value", (a,), whole, lowest)
        asked, holds = _QUESTIONS[op]
        return quantity, (asked, y), holds

    def near(self, expr: Builtin, bound: Depths) -> Near | None:
        """`near` as a question about how far apart two values are, so that tolerances are related.

        None for a tolerance that is not constant. Poses have two tolerances.
        """
        a, b, *limits = (self._numbering.number(arg, bound) for arg in expr.args)
        tolerances = [_as_number(self._numbering.value(limit)) for limit in limits]
        match tolerances:
            case [float() | int() as tolerance]:
                return Quantity("distance", (min(a, b), max(a, b)), False, 0.0), ("<=", tolerance)
            case [float() | int() as distance, float() | int() as angle]:
                return Apart((a, b)), (distance, angle)
        return None


def _as_number(value: Scalar | None) -> float | None:
    return None if value is None or isinstance(value, (bool, str)) else value


def _negative(expr: Expr) -> Expr:
    return Unary("-", expr, type=expr.type)


def least(expr: Expr, number: Callable[[Expr], int]) -> float | None:
    """A lower bound of a number by what it is; equal value numbers are equal values."""
    match expr:
        case Builtin(name="len", args=(several,)):
            return float(isinstance(several.type, ListOf) and several.type.nonempty)
        case Builtin(name=name) if name in _NEVER_NEGATIVE:
            return 0.0
        case Clock():
            return 0.0
        case Binary(op="**", right=Number(value=power)) if power > 0 and power % 2 == 0:
            return 0.0
        case Binary(op="*", left=left, right=right) if number(left) == number(right):
            return 0.0
        case Builtin(name="max", args=args):
            known = [_least_or_known(arg, number) for arg in args]
            return max((n for n in known if n is not None), default=None)
        case Builtin(name="min", args=args):
            known = [_least_or_known(arg, number) for arg in args]
            return None if None in known else min(n for n in known if n is not None)
    return None


def _least_or_known(expr: Expr, number: Callable[[Expr], int]) -> float | None:
    return expr.value if isinstance(expr, Number) else least(expr, number)
