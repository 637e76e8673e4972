"""Values of the language as terms: what is not known of is an unknown function of its parts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import z3

from specc.model.expr import Builtin, Call, Choice, Component, Expr, FieldOf, children
from specc.model.types import Bool, Enum, Int, Real, Text, Type
from specc.proof.numbering import Numbering, labels

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
