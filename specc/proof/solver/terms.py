"""Values of the language as terms of the solver: numbers in linear arithmetic, rounded or exact."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import z3

from specc.lang.builtins import FUNCTIONS
from specc.lang.kinds import kind
from specc.lang.values import SIGNS
from specc.limits import OUT_OF_STEPS, spend
from specc.model.expr import (
    Binary,
    Builtin,
    Call,
    Choice,
    Clock,
    Component,
    Expr,
    FieldOf,
    Unary,
    children,
)
from specc.model.types import Enum, Int, Real
from specc.proof.numbering import Numbering, labels
from specc.proof.solver.rounding import Rounding, constant
from specc.proof.verdict import SolverError

VALUE = z3.DeclareSort("value")
_SORTS: dict[str, Any] = {"truth": z3.BoolSort(), "real": z3.RealSort()}
_SORTS |= dict.fromkeys(("whole", "item"), z3.IntSort())
_LARGEST_EXACT = 2**53
_LARGEST_FLOAT = 2**1023
_EXACT_FACTORS = frozenset(sign * 2.0**power for power in range(64) for sign in (1, -1))
"""Factors with which the product of a float is a float, if it is finite."""
_APPLIED = (Builtin, Call, Component, FieldOf)


STEPS_OF_A_TERM = 25
"""Steps of proofs that making one takes."""


def count_term() -> None:
    """Count a term before it is made. Raises SolverError if no steps are left."""
    if not spend("proof", STEPS_OF_A_TERM):
        raise SolverError(OUT_OF_STEPS)


class Terms:
    """Terms of all types, of expressions without variables of quantifiers.

    A real number is the float that a run has. Equal arguments give equal results; a real number as
    an argument is known by the expression that it comes from only, since 0.0 and -0.0 are equal,
    but not the same argument.
    """

    def __init__(self, numbering: Numbering, *, exact: bool) -> None:
        """`exact` takes results of operations as they are, not as they are rounded."""
        self._numbering = numbering
        self.rounding = Rounding(exact)
        self._numbers: dict[tuple[int, bool], Any] = {}
        self._texts: dict[str, int] = {}
        self._terms: dict[tuple[str, int], Any] = {}
        self.laws: list[Any] = []
        """What is true of terms whatever their values."""

    def boolean(self, expr: Expr) -> Any:
        """The term of a truth value."""
        raise NotImplementedError

    def item(self, expr: Expr) -> Any:
        """The term of a member of an enum, or of a text."""
        return self._once("item", expr, self._item)

    def _once(self, kind: str, expr: Expr, make: Callable[[Expr], Any]) -> Any:
        """The term that `make` gives, made once; lets may name each other many times over."""
        expr = self._numbering.resolve(expr)
        key = kind, self._numbering.number(expr)
        if key not in self._terms:
            count_term()
            self._terms[key] = make(expr)
        return self._terms[key]

    def _item(self, expr: Expr) -> Any:
        known = self._numbering.constant_value(self._numbering.number(expr))
        if isinstance(known, str):
            enum = expr.type
            members = enum.members if isinstance(enum, Enum) else ()
            if known in members:
                return z3.IntVal(members.index(known))
            return z3.IntVal(self._texts.setdefault(known, len(self._texts)))
        if isinstance(expr, Choice):
            then, otherwise = self.item(expr.then), self.item(expr.otherwise)
            return z3.If(self.boolean(expr.test), then, otherwise)
        return self.unknown(expr)

    def prepare(self, expr: Expr) -> None:
        """Make the term of a value before others are made of it."""
        if isinstance(expr.type, Real):
            self.number(expr)
        else:
            self.argument(expr)

    def argument(self, expr: Expr) -> Any:
        """The term of a value as an argument of an operator."""
        return self._once(f"argument {type(expr.type).__name__}", expr, self._argument)

    def _argument(self, expr: Expr) -> Any:
        match kind(expr.type).sort:
            case "truth":
                return self.boolean(expr)
            case "whole":
                return self.number(expr)
            case "item":
                return self.item(expr)
        if isinstance(expr, Choice):
            arms = map(self._value, (expr.then, expr.otherwise))
            return z3.If(self.boolean(expr.test), *arms)
        if isinstance(expr.type, Real):
            return self._opaque(expr)
        return self.unknown(expr)

    def _value(self, expr: Expr) -> Any:
        """The term of an argument, as a value of any type."""
        term = self.argument(expr)
        return term if term.sort() == VALUE else self._opaque(expr)

    def _opaque(self, expr: Expr) -> Any:
        """An uninterpreted constant for this expression."""
        return z3.Const(f"argument {self._numbering.number(expr)}", VALUE)

    def unknown(self, expr: Expr) -> Any:
        """An uninterpreted function of the expression's parts; a constant without parts."""
        key = type(expr.type).__name__, self._numbering.number(expr)
        if key not in self._terms:
            self._terms[key] = term = self._unknown(expr, key[1])
            if isinstance(expr.type, Enum):
                self.laws += [term >= 0, term < len(expr.type.members)]
        return self._terms[key]

    def _unknown(self, expr: Expr, number: int) -> Any:
        sort = _SORTS.get(kind(expr.type).sort, VALUE)
        if not isinstance(expr, _APPLIED):
            return z3.Const(f"{sort} {number}", sort)
        arguments = [self.argument(child) for child in children(expr)]
        if not arguments:
            return z3.Const(f"{sort} {number}", sort)
        sorts = [argument.sort() for argument in arguments]
        name = f"{type(expr).__name__} {labels(expr)} {sorts} {sort}"
        return z3.Function(name, *sorts, sort)(*arguments)

    def number(self, expr: Expr) -> Any:
        """The term of an expression of type int or real."""
        expr = self._numbering.resolve(expr)
        key = self._numbering.number(expr)
        memo = key, isinstance(expr.type, Int)
        if memo not in self._numbers:
            count_term()
            self._numbers[memo] = self._number(expr, key)
        return self._numbers[memo]

    def _number(self, expr: Expr, key: int) -> Any:
        known = self._numbering.constant_number(expr)
        if known is not None and isinstance(expr.type, Int):
            return z3.IntVal(int(known))  # 2 and 2.0 have one number, whichever came first
        if known is not None and math.isfinite(known):
            term = constant(known)
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
        function = FUNCTIONS[expr.name]
        if function.term is not None:
            return function.term(self, *self._converted(expr.args, expr))
        term = self._leaf(expr)
        if function.laws is not None:
            self.laws += function.laws(self, term, *self._converted(expr.args, expr))
        return term

    def constant(self, value: float | Fraction) -> Any:
        """The term of a number."""
        return constant(value)

    def whole(self, value: int) -> Any:
        """The term of a whole number."""
        return z3.IntVal(value)

    def choice(self, test: Any, then: Any, otherwise: Any) -> Any:
        """`then if test else otherwise`."""
        return z3.If(test, then, otherwise)

    def floor(self, number: Any) -> Any:
        """The greatest whole number that is not greater."""
        return z3.ToInt(number) if number.is_real() else number

    def representable(self, number: Any) -> Any:
        """A number of which it is known that a float has it."""
        return self.rounding.float(number)

    def _converted(self, chosen: Sequence[Expr], expr: Expr) -> list[Any]:
        """The alternatives of a choice; an integer among reals is converted to a float."""
        read = self.number if isinstance(expr.type, Int) else self.as_float
        return [read(part) for part in chosen]

    def _operation(self, expr: Binary, key: int) -> Any:
        whole = isinstance(expr.left.type, Int) and isinstance(expr.right.type, Int)
        read = self.number if whole else self.as_float
        factor = self._numbering.constant_number(expr.right) or None
        if factor is None and expr.op == "*":
            factor = self._numbering.constant_number(expr.left) or None
        if expr.op in "*/" and factor is None:
            return self._leaf(expr)
        a, b = read(expr.left), read(expr.right)
        result = SIGNS[expr.op].value(z3.ToReal(a) if whole and expr.op == "/" else a, b)
        if isinstance(expr.type, Int):
            return result
        is_exact = expr.op == "*" and factor in _EXACT_FACTORS
        return self.rounding.rounded(key, result, is_exact=is_exact, is_sum=expr.op in "+-")

    def as_float(self, expr: Expr) -> Any:
        """The term of a number converted to a float."""
        if not isinstance(expr.type, Int):
            return self.number(expr)
        key, known = self._numbering.number(expr), self._numbering.constant_number(expr)
        if known is not None and abs(known) < _LARGEST_FLOAT:
            return self.rounding.float(constant(float(known)))
        term = z3.ToReal(self.number(expr))
        if _is_float(self._numbering.resolve(expr)):
            return self.rounding.float(term)
        return term if known is not None else self.rounding.rounded(f"float {key}", term)

    def _component(self, expr: Component) -> Any:
        """A component of a vector, computed from components of the operands."""
        value = self._numbering.resolve(expr.value)

        def part(of: Expr) -> Expr:
            is_factor = of.type != expr.value.type and isinstance(of.type, (Int, Real))
            return of if is_factor else replace(expr, value=of)

        if expr.index < 0:
            return self._leaf(expr)
        item = self._numbering.literal_item(expr)
        if item is not None:
            return self.number(item) if isinstance(expr.type, Int) else self.as_float(item)
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
        least, greatest = self._numbering.range_of(expr)
        if least > -math.inf:
            self.laws.append(term >= constant(least))
        if greatest < math.inf:
            self.laws.append(term <= constant(greatest))
        return term

    def periods(self) -> Any:
        """The number of periods that the state has lasted."""
        term = z3.Int("periods")
        self.laws.append(term >= 1)
        return term


def _is_float(whole: Expr) -> bool:
    """Whether a whole number is made of a float, and one itself."""
    return (
        isinstance(whole, Builtin)
        and FUNCTIONS[whole.name].stays_float
        and isinstance(whole.args[0].type, Real)
    )
