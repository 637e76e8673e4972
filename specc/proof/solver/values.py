"""Values for the solver: bounds of rounding, components and items."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import z3

from specc.model.expr import Builtin, Call, Choice, Component, Expr, FieldOf, children
from specc.model.types import Bool, Enum, Int, Real, Text, Type
from specc.proof.numbering import Numbering, labels

# What is known of rounded results: they keep order with every float, and are not far off.


MOST_ORDERED = 3000
"""Pairs of numbers whose order is kept; beyond them a question is too large."""
_HALF_ULP = Fraction(1, 2**53)
_HALF_SMALLEST = Fraction(1, 2**1075)
_LARGEST = Fraction(2**1024 - 2**971)


class Rounding:
    """Floats and results of operations on them, which are the exact results, rounded.

    Every run satisfies the facts: rounding to nearest keeps order, and leaves floats as they are.
    An infinity satisfies them as a number larger than all others do. `exact` leaves rounding out.
    """

    def __init__(self, exact: bool) -> None:
        self._exact = exact
        self._floats: dict[int, Any] = {}
        self._results: dict[object, tuple[Any, Any]] = {}
        self._facts: list[Any] = []

    def float(self, term: Any) -> Any:
        """The term itself, which stands for a float."""
        self._floats[term.get_id()] = term
        return term

    def rounded(self, key: object, exact: Any, *, kept: bool = False, is_sum: bool = False) -> Any:
        """The result of an operation; `key` names it. A result that is a float can be `kept`.

        A sum or difference of two floats is a multiple of the smallest one, so it does not vanish.
        """
        if self._exact:
            return exact
        if key not in self._results:
            self._results[key] = exact, (result := z3.Real(f"rounded {key}"))
            least = 0 if is_sum or kept else _HALF_SMALLEST
            self._facts.append(_is_close(exact, result, 0 if kept else _HALF_ULP, least))
        return self._results[key][1]

    @property
    def matters(self) -> bool:
        """Whether anything is rounded."""
        return bool(self._results)

    @property
    def is_large(self) -> bool:
        """Whether there is too much to be in order."""
        results = len(self._results)
        return results * (results + len(self._floats)) > MOST_ORDERED

    def facts(self) -> list[Any]:
        """Facts about all results."""
        found = list(self._facts)
        results = list(self._results.values())
        for index, (exact, result) in enumerate(results):
            others = [*((t, t) for t in self._floats.values()), *results[:index]]
            for other_exact, other in others:
                found.append(z3.Implies(exact <= other_exact, result <= other))
                found.append(z3.Implies(exact >= other_exact, result >= other))
            for _, other in results:  # a result is a float
                if other is not result:
                    found.append(z3.Implies(exact <= other, result <= other))
                    found.append(z3.Implies(exact >= other, result >= other))
        return found


def _is_close(exact: Any, result: Any, relative: Fraction | int, least: Fraction | int) -> Any:
    size = z3.If(exact < 0, -exact, exact)
    error = z3.If(exact < result, result - exact, exact - result)
    bound = _term(relative) * size + _term(least)
    largest = _term(_LARGEST)
    return z3.And(
        z3.Implies(size <= largest, error <= bound),
        z3.Implies(exact > largest, result >= largest),
        z3.Implies(-exact > largest, -result >= largest),
    )


def _term(value: Fraction | int) -> Any:
    return z3.RealVal(str(value))


# Values of the language as terms: what is not known of is an unknown function of its parts.


VALUE = z3.DeclareSort("value")
_APPLIED = (Builtin, Call, Component, FieldOf)


class Values:
    """Terms of all types, of expressions without variables of quantifiers.

    Equal arguments give equal results; a real number as an argument is known by the expression
    that it comes from only, since 0.0 and -0.0 are equal, but not the same argument.
    """

    def __init__(self, numbering: Numbering) -> None:
        self._numbering = numbering
        self._texts: dict[str, int] = {}
        self._made: dict[tuple[str, int], Any] = {}
        self.laws: list[Any] = []
        """What is true of terms whatever their values."""

    def boolean(self, expr: Expr) -> Any:
        """The term of a truth value."""
        raise NotImplementedError

    def number(self, expr: Expr) -> Any:
        """The term of a number."""
        raise NotImplementedError

    def item(self, expr: Expr) -> Any:
        """The term of a member of an enum, or of a text."""
        return self._once("item", expr, self._item)

    def _once(self, kind: str, expr: Expr, make: Callable[[Expr], Any]) -> Any:
        """The term that `make` gives, made once; lets may name each other many times over."""
        expr = self._numbering.looked_through(expr)
        key = kind, self._numbering.number(expr)
        if key not in self._made:
            self._made[key] = make(expr)
        return self._made[key]

    def _item(self, expr: Expr) -> Any:
        known = self._numbering.value(self._numbering.number(expr))
        if isinstance(known, str):
            enum = expr.type
            members = enum.members if isinstance(enum, Enum) else ()
            return z3.IntVal(members.index(known) if known in members else self._text(known))
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
        match expr.type:
            case Bool():
                return self.boolean(expr)
            case Int():
                return self.number(expr)
            case Enum() | Text():
                return self.item(expr)
        if isinstance(expr, Choice):
            then, otherwise = self.argument(expr.then), self.argument(expr.otherwise)
            return z3.If(self.boolean(expr.test), then, otherwise)
        if isinstance(expr.type, Real):
            return z3.Const(f"argument {self._numbering.number(expr)}", VALUE)
        return self.unknown(expr)

    def unknown(self, expr: Expr) -> Any:
        """A value of which only its parts are known, if it has any."""
        key = type(expr.type).__name__, self._numbering.number(expr)
        if key not in self._made:
            self._made[key] = term = self._unknown(expr, key[1])
            if isinstance(expr.type, Enum):
                self.laws += [term >= 0, term < len(expr.type.members)]
        return self._made[key]

    def _unknown(self, expr: Expr, number: int) -> Any:
        sort = _sort(expr.type)
        if not isinstance(expr, _APPLIED):
            return z3.Const(f"{sort} {number}", sort)
        arguments = [self.argument(child) for child in children(expr)]
        if not arguments:
            return z3.Const(f"{sort} {number}", sort)
        sorts = [argument.sort() for argument in arguments]
        name = f"{type(expr).__name__} {labels(expr)} {sorts} {sort}"
        return z3.Function(name, *sorts, sort)(*arguments)

    def _text(self, text: str) -> int:
        return self._texts.setdefault(text, len(self._texts))


def _sort(type_: Type) -> Any:
    match type_:
        case Bool():
            return z3.BoolSort()
        case Int() | Enum() | Text():
            return z3.IntSort()
        case Real():
            return z3.RealSort()
    return VALUE
