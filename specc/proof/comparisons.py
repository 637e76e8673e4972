"""Comparisons of numbers as questions about a quantity, so that thresholds are in order."""

from __future__ import annotations

import operator

from specc.model.expr import Builtin, Clock, Expr, Unary
from specc.model.types import Int
from specc.proof.numbering import Depths, Numbering, Scalar
from specc.proof.variables import Bound, Quantity

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
_NEVER_NEGATIVE = ("len", "abs", "norm")

Question = tuple[Quantity, Bound, bool]


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
        whole = isinstance(left.type, Int) and isinstance(right.type, Int)
        if y is None:
            quantity, y = Quantity("difference", (a, b), whole, None), 0.0
        else:
            quantity = Quantity("value", (a,), whole, _least(left))
        asked, holds = _QUESTIONS[op]
        return quantity, (asked, y), holds

    def near(self, expr: Builtin, bound: Depths) -> tuple[Quantity, Bound] | None:
        """`near(a, b, tolerance)` as a question about a distance, so that tolerances are related.

        None for poses, which have two tolerances, and for a tolerance that is not constant.
        """
        if len(expr.args) != 3:
            return None
        a, b, limit = (self._numbering.number(arg, bound) for arg in expr.args)
        tolerance = _as_number(self._numbering.value(limit))
        if tolerance is None:
            return None
        distance = Quantity("distance", (min(a, b), max(a, b)), False, 0.0)
        return distance, ("<=", tolerance)


def _as_number(value: Scalar | None) -> float | None:
    return None if value is None or isinstance(value, (bool, str)) else value


def _negative(expr: Expr) -> Expr:
    return Unary("-", expr, type=expr.type)


def _least(expr: Expr) -> float | None:
    """A lower bound of a number by what it is."""
    match expr:
        case Builtin(name=name) if name in _NEVER_NEGATIVE:
            return 0.0
        case Clock():
            return 0.0
    return None
