"""Numbers of the language as terms of linear arithmetic; others are numbers by themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import z3

from specc.model.expr import Binary, Builtin, Choice, Clock, Component, Expr, Unary
from specc.model.types import Int, Real
from specc.proof.comparisons import least
from specc.proof.numbering import Numbering
from specc.proof.solver.values import Rounding, Values

_LARGEST_EXACT = 2**53
_LARGEST_FLOAT = 2**1023


class Arithmetic(Values):
    """Terms of numbers; a real number is the float that a run has."""

    def __init__(
        self,
        numbering: Numbering,
        *,
        exact: bool,
    ) -> None:
        """`exact` takes results of operations as they are, not as they are rounded."""
        super().__init__(numbering)
        self._numbers: dict[tuple[int, bool], Any] = {}
        self.rounding = Rounding(exact)

    def number(self, expr: Expr) -> Any:
        """The term of an expression of type int or real."""
        expr = self._numbering.looked_through(expr)
        key = self._numbering.number(expr)
        memo = key, isinstance(expr.type, Int)
        if memo not in self._numbers:
            self._numbers[memo] = self._number(expr, key)
        return self._numbers[memo]

    def _number(self, expr: Expr, key: int) -> Any:
        known = self._numbering.value(key)
        if isinstance(known, (int, float)) and isinstance(expr.type, Int):
            return z3.IntVal(int(known))  # 2 and 2.0 have one number, whichever came first
        if isinstance(known, (int, float)) and math.isfinite(known):
            term = exact(known)
            return self.rounding.float(term) if abs(known) <= _LARGEST_EXACT else term
        match expr:
            case Unary(op="-", operand=operand):
                return -self.number(operand)
            case Choice(test=test, then=then, otherwise=otherwise):
                arms = self._converted((then, otherwise), expr)
                return z3.If(self.boolean(test), *arms)
            case Binary(op="+" | "-" | "*" | "/"):
                return self._operation(expr, key)
            case Component():
                return self._component(expr)
            case Builtin():
                return self._builtin(expr)
        return self._leaf(expr)

    def _builtin(self, expr: Builtin) -> Any:
        if expr.name == "float":
            return self.as_float(expr.args[0])
        if expr.name in ("abs", "min", "max"):
            return _chosen(expr.name, self._converted(expr.args, expr))
        return self._leaf(expr)

    def _converted(self, chosen: Sequence[Expr], expr: Expr) -> list[Any]:
        """What an expression chooses from: an integer among reals becomes a float first."""
        read = self.number if isinstance(expr.type, Int) else self.as_float
        return [read(part) for part in chosen]

    def _operation(self, expr: Binary, key: int) -> Any:
        whole = isinstance(expr.left.type, Int) and isinstance(expr.right.type, Int)
        read = self.number if whole else self.as_float
        factor = self._known(expr.right)
        if factor is None and expr.op == "*":
            factor = self._known(expr.left)
        if expr.op in "*/" and factor is None:
            return self._leaf(expr)
        a, b = read(expr.left), read(expr.right)
        match expr.op:
            case "+":
                result = a + b
            case "-":
                result = a - b
            case "*":
                result = a * b
            case _:
                result = (z3.ToReal(a) if whole else a) / b
        if isinstance(expr.type, Int):
            return result
        kept = expr.op == "*" and factor in _EXACT_FACTORS
        return self.rounding.rounded(key, result, kept=kept, is_sum=expr.op in "+-")

    def as_float(self, expr: Expr) -> Any:
        """A number as an operation on floats takes it."""
        if not isinstance(expr.type, Int):
            return self.number(expr)
        key = self._numbering.number(expr)
        known = self._numbering.value(key)
        if isinstance(known, (int, float)) and abs(known) < _LARGEST_FLOAT:
            return self.rounding.float(exact(float(known)))
        term = z3.ToReal(self.number(expr))
        return term if known is not None else self.rounding.rounded(f"float {key}", term)

    def _component(self, expr: Component) -> Any:
        """A component of a vector, by the components of what it is computed from."""
        value = self._numbering.looked_through(expr.value)

        def part(of: Expr) -> Expr:
            return replace(expr, value=of) if _has_parts(of, expr) else of

        if expr.index < 0:
            return self._leaf(expr)
        item = self._numbering.written(expr)
        if item is not None:
            return self.as_float(item)
        match value:
            case Unary(op="-", operand=operand):
                return self.number(Unary("-", part(operand), type=expr.type))
            case Binary(op="+" | "-" | "*" | "/" as op, left=left, right=right):
                return self.number(Binary(op, part(left), part(right), type=expr.type))
            case Choice(test=test, then=then, otherwise=otherwise):
                return self.number(Choice(test, part(then), part(otherwise), type=expr.type))
        return self._leaf(expr)

    def _leaf(self, expr: Expr) -> Any:
        term = self.unknown(expr)
        if not isinstance(expr.type, Int):
            self.rounding.float(term)
        step = self._numbering.exact_period_s
        if isinstance(expr, Clock) and step is not None:
            time = z3.RealVal(str(step)) * z3.ToReal(self.periods())
            error = time / 2**53
            self.laws.append(z3.And(term - time <= error, time - term <= error))
        bound = least(expr, self._numbering.number)
        if bound is not None:
            self.laws.append(term >= exact(bound))
        return term

    def periods(self) -> Any:
        """The number of periods that the state has lasted."""
        term = z3.Int("periods")
        self.laws.append(term >= 1)
        return term

    def _known(self, expr: Expr) -> float | None:
        known = self._numbering.value(self._numbering.number(expr))
        return known if isinstance(known, (int, float)) and known != 0 else None


_EXACT_FACTORS = frozenset(sign * 2.0**power for power in range(64) for sign in (1, -1))
"""Factors with which the product of a float is a float, if it is finite."""


def exact(value: float) -> Any:
    """The term of a finite number."""
    return z3.RealVal(str(Fraction(value)))


def compared(op: str, a: Any, b: Any) -> Any:
    """The comparison of two terms."""
    match op:
        case "<":
            return a < b
        case "<=":
            return a <= b
        case ">":
            return a > b
        case ">=":
            return a >= b
        case "!=":
            return a != b
    return a == b


def _has_parts(expr: Expr, component: Component) -> bool:
    """Whether an operand is a vector itself, and not what one is multiplied by."""
    return expr.type == component.value.type or not isinstance(expr.type, (Int, Real))


def _chosen(name: str, terms: list[Any]) -> Any:
    """The least or the greatest of some terms, or the absolute value of one."""
    first, *rest = terms
    for other in rest if name != "abs" else (-first,):
        first = z3.If(first < other if name == "min" else first > other, first, other)
    return first
