"""Comparisons with the time in a state: whole periods, at one of which the answer turns."""

from __future__ import annotations

from functools import reduce

from specc.model.expr import Binary, Builtin, Clock, Expr, Unary
from specc.proof.numbering import Numbering

LONGEST = 2**40
"""Periods that no state lasts; later ones are not asked about."""
_NO_TREND = 2
_COMPARED = {
    "<": float.__lt__,
    "<=": float.__le__,
    ">": float.__gt__,
    ">=": float.__ge__,
}


class Timer:
    """Values of what is computed from `elapsed` and constants alone, as generated code has them."""

    def __init__(self, numbering: Numbering) -> None:
        self._numbering = numbering
        self._trends: dict[int, int] = {}  # by value number: what is named twice is asked once

    def turn(self, op: str, left: Expr, right: Expr) -> tuple[int, bool] | None:
        """The first period in which `left op right` is not what it was before, and its truth then.

        It is 1 if the truth never changes. None if this is no such comparison, or goes up and down.
        """
        if self._numbering.exact_period_s is None or op not in _COMPARED:
            return None
        trend = _joint(self._trend(left), _turned_round(self._trend(right)))
        if trend in (0, _NO_TREND):
            return None
        try:
            return self._turned(op, left, right)
        except (ArithmeticError, ValueError):
            return None

    def _turned(self, op: str, left: Expr, right: Expr) -> tuple[int, bool]:
        def holds(periods: int) -> bool:
            at: dict[int, float] = {}
            a, b = self._at(left, periods, at), self._at(right, periods, at)
            return bool(_COMPARED[op](a, b))

        early, late = 1, LONGEST
        if holds(early) == holds(late):
            return 1, holds(early)
        while late - early > 1:
            middle = (early + late) // 2
            if holds(middle) == holds(early):
                early = middle
            else:
                late = middle
        return late, holds(late)

    def _trend(self, expr: Expr) -> int:
        """1 if the value never falls with time, -1 if it never rises, 0 if it is known.

        Rounding keeps the order of sums and products, so that this holds of floats.
        """
        number = self._numbering.number(expr)
        if number not in self._trends:
            self._trends[number] = self._computed_trend(expr)
        return self._trends[number]

    def _computed_trend(self, expr: Expr) -> int:
        if self._known(expr) is not None:
            return 0
        expr = self._numbering.looked_through(expr)
        match expr:
            case Clock(name="elapsed"):
                return 1
            case Unary(op="-", operand=operand):
                return _turned_round(self._trend(operand))
            case Binary(op="+" | "-" as op, left=a, right=b):
                other = self._trend(b)
                return _joint(self._trend(a), other if op == "+" else _turned_round(other))
            case Binary(op="*", left=a, right=b) if self._known(b) is None:
                return self._scaled(b, self._known(a))
            case Binary(op="*" | "/", left=a, right=b):
                return self._scaled(a, self._known(b))
            case Builtin(name="min" | "max", args=args):
                return reduce(_joint, map(self._trend, args))
        return _NO_TREND

    def _scaled(self, expr: Expr, factor: float | None) -> int:
        if not factor:
            return _NO_TREND
        return self._trend(expr) if factor > 0 else _turned_round(self._trend(expr))

    def _known(self, expr: Expr) -> float | None:
        value = self._numbering.value(self._numbering.number(expr))
        return value if isinstance(value, (int, float)) and not isinstance(value, bool) else None

    def _at(self, expr: Expr, periods: int, at: dict[int, float]) -> float:
        """The value after so many periods; `at` keeps those of the parts, by value number."""
        number = self._numbering.number(expr)
        if number not in at:
            at[number] = self._computed_at(expr, periods, at)
        return at[number]

    def _computed_at(self, expr: Expr, periods: int, at: dict[int, float]) -> float:
        """The arithmetic is that of a run."""
        known = self._known(expr)
        if known is not None:
            return float(known)
        expr = self._numbering.looked_through(expr)
        match expr:
            case Unary(operand=operand):
                return -self._at(operand, periods, at)
            case Binary(op=op, left=left, right=right):
                a, b = self._at(left, periods, at), self._at(right, periods, at)
                return a + b if op == "+" else a - b if op == "-" else a * b if op == "*" else a / b
            case Builtin(name=name, args=args):
                return (min if name == "min" else max)(self._at(arg, periods, at) for arg in args)
        assert self._numbering.exact_period_s is not None  # `turn` looked
        return float(periods * self._numbering.exact_period_s)


def _turned_round(trend: int) -> int:
    return trend if trend == _NO_TREND else -trend


def _joint(a: int, b: int) -> int:
    """The trend of a sum."""
    if _NO_TREND in (abs(a), abs(b)) or a * b < 0:
        return _NO_TREND
    return a or b
