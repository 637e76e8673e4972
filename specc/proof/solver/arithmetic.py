"""Numbers of the language as terms of linear arithmetic; others are numbers by themselves."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import z3

from specc.model.expr import (
    Binary,
    Builtin,
    Compare,
    Component,
    Expr,
    Items,
    Unary,
)
from specc.model.types import Int, Real
from specc.proof.formula import Atom
from specc.proof.numbering import Numbering
from specc.proof.variables import Quantity

_BOUNDED_BELOW = ("len", "norm")


class Arithmetic:
    """Terms of one subsystem; equal terms stand for equal numbers in one period."""

    def __init__(self, numbering: Numbering) -> None:
        self._numbering = numbering
        self._bounds: dict[str, Any] = {}

    def comparison(self, quantity: Quantity, atom: Atom) -> Any:
        """The question of an atom about a quantity."""
        match atom.expr:
            case Compare(op=op, left=left, right=right):
                holds = _compared(op, self.term(left), self.term(right))
                return holds if atom.text_holds else z3.Not(holds)
            case Builtin(name="near", args=(a, b, _)) if _is_scalar(a):
                gap, limit = self.term(a) - self.term(b), _exact(atom.test[1])
                return z3.And(gap <= limit, -gap <= limit)
        op, limit = atom.test
        distance = z3.Real(f"{quantity.kind} {quantity.of}")
        if quantity.least is not None:
            self._bounds[str(distance)] = distance >= _exact(quantity.least)
        return _compared(op, distance, _exact(limit))

    def bounds(self) -> list[Any]:
        """What is known of terms by what they are: a length is not negative."""
        return list(self._bounds.values())

    def term(self, expr: Expr) -> Any:
        """The term of an expression of type int or real."""
        expr = self._numbering.looked_through(expr)
        known = self._numbering.value(self._numbering.number(expr))
        if isinstance(known, (int, float)) and not isinstance(known, bool):
            return _exact(known)
        match expr:
            case Unary(op="-", operand=operand):
                return -self.term(operand)
            case Binary(op="+" | "-" as op, left=left, right=right):
                a, b = self.term(left), self.term(right)
                return a + b if op == "+" else a - b
            case Binary(op="*", left=left, right=right) if self._is_known(left, right):
                return self.term(left) * self.term(right)
            case Binary(op="/", left=left, right=right) if self._is_known(right):
                return self.term(left) / self.term(right)
            case Component(value=value, index=index):
                return self._component(value, index, expr)
            case Builtin(name="abs" | "min" | "max" as name, args=args):
                return _chosen(name, [self.term(arg) for arg in args])
        return self._opaque(expr)

    def _component(self, value: Expr, index: int, whole: Expr) -> Any:
        """A component of a vector, by the components of what it is computed from."""
        value = self._numbering.looked_through(value)

        def part(of: Expr) -> Any:
            return self.term(Component(of, index, type=whole.type))

        match value:
            case Items(items=items) if index < len(items):
                return self.term(items[index])
            case Unary(op="-", operand=operand):
                return -part(operand)
            case Binary(op="+" | "-" as op, left=left, right=right):
                return part(left) + part(right) if op == "+" else part(left) - part(right)
        return self._opaque(whole)

    def _opaque(self, expr: Expr) -> Any:
        name = f"number {self._numbering.number(expr)}"
        term = z3.ToReal(z3.Int(name)) if isinstance(expr.type, Int) else z3.Real(name)
        if isinstance(expr, Builtin) and expr.name in _BOUNDED_BELOW:
            self._bounds[name] = term >= 0
        return term

    def _is_known(self, *candidates: Expr) -> bool:
        numbers = (self._numbering.value(self._numbering.number(c)) for c in candidates)
        return any(n is not None and n != 0 for n in numbers)


def _chosen(name: str, terms: list[Any]) -> Any:
    """The least or the greatest of some terms, or the absolute value of one."""
    first, *rest = terms
    for other in rest if name != "abs" else (-first,):
        first = z3.If(first < other if name == "min" else first > other, first, other)
    return first


def _is_scalar(expr: Expr) -> bool:
    return isinstance(expr.type, (Int, Real))


def _exact(value: float) -> Any:
    return z3.RealVal(str(Fraction(value)))


def _compared(op: str, a: Any, b: Any) -> Any:
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
