"""Conditions for the solver, with quantifiers written out."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import z3

from specc.lang.builtins import FUNCTIONS
from specc.lang.kinds import kind
from specc.limits import OUT_OF_STEPS, spend
from specc.model.expr import (
    COMPARISONS,
    LENGTH,
    Builtin,
    Choice,
    Clock,
    Compare,
    Component,
    Expr,
    Fresh,
    IsOneOf,
    Items,
    Logic,
    Number,
    Present,
    Quantifier,
    Unary,
    children,
    instantiate,
    walk,
)
from specc.model.types import Enum, Int, ListOf, Pose, Vector
from specc.proof.clock import asks_entry
from specc.proof.numbering import Numbering
from specc.proof.solver.terms import STEPS_OF_A_TERM, Terms, count_term
from specc.proof.verdict import SolverError

MOST_ITEMS = 64
"""Components of a vector that a condition is spelt out for."""
MOST_PARTS = 12_000
"""Parts of conditions that are spelt out for items, in one question: a part takes about 25 us."""


class Conditions(Terms):
    """Terms of conditions.

    A quantifier is said of each component of a vector. Of a list it is said of as many items as
    there are quantifiers over it, since more are never needed to show what holds of some item. A
    quantifier within another one may need some for each: of longer lists nothing is known of it.
    """

    def __init__(
        self,
        numbering: Numbering,
        quantified: Mapping[int, Collection[int]],
        *,
        exact: bool,
    ) -> None:
        """`quantified`: numbers of lists -> numbers of the quantifiers that are said of items."""
        super().__init__(numbering, exact=exact)
        self._quantified = quantified
        self._booleans: dict[int, Any] = {}
        self._parts = 0

    def boolean(self, expr: Expr) -> Any:
        """The term of an expression of type bool."""
        expr = self._numbering.resolve(expr)
        key = self._numbering.number(expr)
        if key not in self._booleans:
            count_term()
            self._booleans[key] = self._boolean(expr, key)
        return self._booleans[key]

    def _boolean(self, expr: Expr, key: int) -> Any:
        known = self._numbering.constant_value(key)
        if isinstance(known, bool):
            return z3.BoolVal(known)
        is_negation = isinstance(expr, Unary) and expr.op == "not"
        is_compound = isinstance(expr, (Logic, Choice)) or is_negation
        parts = [self.boolean(part) for part in children(expr)] if is_compound else []
        match expr:
            case Unary():
                term = z3.Not(*parts)
            case Logic(op=op):
                term = z3.And(parts) if op == "and" else z3.Or(parts)
            case Choice():
                term = z3.If(*parts)
            case Compare(op=op, left=left, right=right):
                term = self._compare(op, left, right)
            case Builtin(name=name, args=(a, b, *limits)) if FUNCTIONS[name].compares:
                near = self._near_pose if isinstance(a.type, Pose) else self._near
                term = near(a, b, *map(self.number, limits))
            case Quantifier():
                term = self._quantifier(expr)
            case _:
                term = self._fact(expr)
        return term

    def in_periods(self, condition: Any, turn: float, holds_if: bool) -> Any:
        """That a state has lasted fewer periods than `turn`, for a question about the time."""
        sides = map(self._numbering.resolve, children(condition))
        term = self.periods() < int(turn)
        if isinstance(condition, Compare) and all(isinstance(s, (Clock, Number)) for s in sides):
            comparison = self.boolean(condition)
            self.laws.append(term == (comparison if holds_if else z3.Not(comparison)))
        return term

    def _fact(self, expr: Expr) -> Any:
        match expr:
            case IsOneOf(item=item, members=members) if isinstance(item.type, Enum):
                term = self.item(item)
                return z3.Or([term == item.type.members.index(m) for m in sorted(members)])
            case Fresh(input=element) | Present(input=element):
                return arrived(element.peer, element.element, type(expr).__name__.lower())
            case _ if asks_entry(expr) and self._numbering.period_s is not None:
                return z3.BoolVal(False)
        return self.unknown(expr)

    def _compare(self, op: str, left: Expr, right: Expr) -> Any:
        of = left.type
        match kind(of).sort, kind(right.type).sort:
            case "truth", _:
                return COMPARISONS[op](self.boolean(left), self.boolean(right))
            case "item", _:
                return COMPARISONS[op](self.item(left), self.item(right))
            case (("whole" | "real"), ("whole" | "real")):
                return COMPARISONS[op](*self._sides(left, right))
        if not isinstance(of, Vector):
            return COMPARISONS[op](self.argument(left), self.argument(right))
        same = z3.And([self._compare("==", *pair) for pair in self._pairs(left, right, of)])
        self.laws.append(z3.Implies(same, self.argument(left) == self.argument(right)))
        return same if op == "==" else z3.Not(same)

    def _sides(self, left: Expr, right: Expr) -> tuple[Any, Any]:
        """Two numbers as a comparison takes them: numpy rounds an integer beside a float."""
        a, b = self.number(left), self.number(right)
        if isinstance(left.type, Int) == isinstance(right.type, Int):
            return a, b
        if any(self._numbering.constant_number(side) is not None for side in (left, right)):
            return a, b
        keys = [self._numbering.number(side) for side in (left, right)]
        # Which of the two it is depends on where the float comes from.
        is_exact = z3.Bool(f"compared exactly {keys}")
        if isinstance(left.type, Int):
            return z3.If(is_exact, z3.ToReal(a), self.as_float(left)), b
        return a, z3.If(is_exact, z3.ToReal(b), self.as_float(right))

    def _near(self, a: Expr, b: Expr, limit: Any) -> Any:
        if isinstance(a.type, Vector):
            return z3.And([self._near(*pair, limit) for pair in self._pairs(a, b, a.type)])
        whole = isinstance(a.type, Int) and isinstance(b.type, Int)
        if whole:
            gap = self.number(a) - self.number(b)
        else:
            keys = [self._numbering.number(side) for side in (a, b)]
            # -(a - b) is exactly b - a.
            first, second = (a, b) if keys[0] <= keys[1] else (b, a)
            gap = self.rounding.rounded(
                f"gap {sorted(keys)}",
                self.as_float(first) - self.as_float(second),
                is_sum=True,
            )
        return z3.And(gap <= limit, -gap <= limit)

    def _near_pose(self, x: Expr, y: Expr, distance: Any, angle: Any) -> Any:
        """Two poses are apart by some distance and some angle, neither of them negative."""
        of = self._numbering.number(x), self._numbering.number(y)
        distance_term, turned = z3.Real(f"distance {of}"), z3.Real(f"angle {of}")
        self.laws += [distance_term >= 0, turned >= 0]
        return z3.And(distance_term <= distance, turned <= angle)

    def _quantifier(self, expr: Quantifier) -> Any:
        over = self._numbering.resolve(expr.over)
        if isinstance(over.type, ListOf) and not isinstance(over, Items):
            return self._quantifier_over_list(expr, over)
        size = len(over.items) if isinstance(over, Items) else getattr(over.type, "size", 0)
        return _joined(expr, self._instances(expr, over, self._components(size)))

    def _quantifier_over_list(self, expr: Quantifier, over: Expr) -> Any:
        """The term, expanded for as many items as there are quantifiers over that list."""
        quantifiers = self._quantified.get(self._numbering.number(over), ())
        length = self.number(Builtin(LENGTH, (over,), type=Int()))
        parts = []
        last = [-1 - index for index in range(len(quantifiers))]
        for index, holds in enumerate(self._instances(expr, over, last)):
            there = length > index
            parts.append(z3.And(there, holds) if expr.kind == "any" else z3.Implies(there, holds))
        formula = _joined(expr, parts)
        if self._numbering.number(expr) in quantifiers:
            return formula
        return z3.If(length <= len(quantifiers), formula, self.unknown(expr))

    def _instances(self, expr: Quantifier, over: Expr, indices: Collection[int]) -> list[Any]:
        """The body, with each of some items in the place of the variable."""
        assert isinstance(over.type, (Vector, ListOf))  # typing guarantees it
        self._count_parts(len(indices) * sum(1 for _ in walk(expr.body)))
        items = (Component(over, index, type=over.type.element) for index in indices)
        return [self.boolean(instantiate(expr.body, expr.variable, item)) for item in items]

    def _pairs(self, a: Expr, b: Expr, kind: Vector) -> Iterator[tuple[Expr, Expr]]:
        """The components of two vectors of a type."""
        indices = self._components(kind.size)
        self._count_parts(2 * len(indices))
        for index in indices:
            yield Component(a, index, type=kind.element), Component(b, index, type=kind.element)

    def _components(self, size: int) -> range:
        if size > MOST_ITEMS:
            raise SolverError(f"a vector of more than {MOST_ITEMS} components is looked into")
        return range(size)

    def _count_parts(self, parts: int) -> None:
        """Count parts of conditions that are about to be said of items."""
        self._parts += parts
        if self._parts > MOST_PARTS:
            raise SolverError(
                f"spelt out for each item, conditions have more than {MOST_PARTS} parts"
            )
        if not spend("proof", parts * STEPS_OF_A_TERM):
            raise SolverError(OUT_OF_STEPS)


def _joined(quantifier: Quantifier, parts: list[Any]) -> Any:
    return z3.Or(parts) if quantifier.kind == "any" else z3.And(parts)


def arrived(peer: str, element: str, test: str) -> Any:
    """The term that an input is fresh, or present."""
    return z3.Bool(f"{test} {peer}.{element}")
