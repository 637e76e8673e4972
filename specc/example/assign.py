"""Ways to give an expression a value, by changing one thing that it depends on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from specc.example.freedom import Freedom
from specc.example.inverses import BUILTINS, inverted
from specc.example.patience import Patience
from specc.example.situation import Meaning, Situation
from specc.example.values import Fields, Value, alike, first_value
from specc.model import expr as m
from specc.model.types import ListOf, Vector

Holding = Callable[[m.Expr, bool, Situation], Iterator[Situation]]
Ways = Iterator[Situation]

_CONDITIONS = (m.Logic, m.Compare, m.Among, m.Quantifier, m.Fresh, m.Present, m.IsNone)


class Assigning:
    """Solves `expression == value` for inputs, memory, results of operators and time."""

    def __init__(
        self, meaning: Meaning, freedom: Freedom, holding: Holding, steps: Patience
    ) -> None:
        """`holding` gives ways to make a condition hold or not; `steps` are left for one search."""
        self._steps = steps
        self._meaning = meaning
        self._freedom = freedom
        self._holding = holding
        self._rules: dict[type, Callable[[Any, Value, Situation], Ways]] = {
            m.Input: lambda e, v, at: freedom.input((e.peer, e.element), v, at),
            m.MemoryRef: lambda e, v, at: freedom.remembered(e.name, v, at),
            m.LetRef: lambda e, v, at: self.ways(meaning.lets[e.name], v, at),
            m.ConstantRef: lambda e, v, at: self.ways(meaning.constants[e.name], v, at),
            m.Call: self._call,
            m.Component: self._component,
            m.FieldOf: self._field,
            m.Items: self._items,
            m.Unary: self._unary,
            m.Binary: self._binary,
            m.Builtin: self._builtin,
            m.Choice: self._choice,
            m.Clock: self._clock,
            m.Sure: lambda e, v, at: self.ways(e.value, v, at),
        }

    def ways(self, expr: m.Expr, value: Value, at: Situation) -> Ways:
        """Situations in which the expression may have the value."""
        rule = self._rules.get(type(expr))
        if not self._steps.spend(1):
            return
        if rule is not None:
            yield from rule(expr, value, at)
        elif isinstance(expr, _CONDITIONS):
            yield from self._holding(expr, value, at)

    def _now(self, expr: m.Expr, at: Situation) -> Value:
        return self._meaning.value(expr, at)

    def _call(self, call: m.Call, value: Value, at: Situation) -> Ways:
        args = tuple(self._now(arg, at) for arg in call.args)
        others = tuple(a for a in at.answers if not (a[0] == call.operator and alike(a[1], args)))
        yield replace(at, answers=(*others, (call.operator, args, value)))

    def _component(self, expr: m.Component, value: Value, at: Situation) -> Ways:
        whole = list(self._now(expr.value, at))
        whole[expr.index] = value
        yield from self.ways(expr.value, tuple(whole), at)

    def _field(self, expr: m.FieldOf, value: Value, at: Situation) -> Ways:
        whole = self._now(expr.value, at)
        if isinstance(whole, Fields):
            yield from self.ways(expr.value, whole.having(expr.name, value), at)

    def _items(self, expr: m.Items, value: Value, at: Situation) -> Ways:
        """The first item that differs; the others are the next steps' matter."""
        for item, wanted in zip(expr.items, value, strict=False):
            if not alike(self._now(item, at), wanted):
                yield from self.ways(item, wanted, at)
                return

    def _unary(self, expr: m.Unary, value: Value, at: Situation) -> Ways:
        if expr.op == "not":
            yield from self._holding(expr, value, at)
        else:
            negative = tuple(-v for v in value) if isinstance(value, tuple) else -value
            yield from self.ways(expr.operand, negative, at)

    def _binary(self, expr: m.Binary, value: Value, at: Situation) -> Ways:
        left, right = self._now(expr.left, at), self._now(expr.right, at)
        for side, wanted in inverted(expr.op, value, left, right):
            yield from self.ways(expr.left if side == 0 else expr.right, wanted, at)

    def _builtin(self, expr: m.Builtin, value: Value, at: Situation) -> Ways:
        if expr.name == "near":
            yield from self._holding(expr, value, at)
        elif expr.name == "len":
            yield from self._length(expr.args[0], value, at)
        elif expr.name in BUILTINS:
            now = [self._now(arg, at) for arg in expr.args]
            for index, wanted in BUILTINS[expr.name](now, value):
                yield from self.ways(expr.args[index], wanted, at)

    def _length(self, of: m.Expr, value: Value, at: Situation) -> Ways:
        """A list made longer or shorter; vectors have the length of their type."""
        if isinstance(of.type, ListOf) and value >= 0:
            now = self._now(of, at)
            more = (first_value(of.type.element),) * max(0, int(value) - len(now))
            yield from self.ways(of, (*now, *more)[: int(value)], at)

    def _choice(self, expr: m.Choice, value: Value, at: Situation) -> Ways:
        branch = expr.then if self._now(expr.test, at) else expr.otherwise
        yield from self.ways(branch, value, at)
        yield from self._holding(expr.test, not self._now(expr.test, at), at)

    def _clock(self, expr: m.Clock, value: Value, at: Situation) -> Ways:
        if expr.name == "elapsed":
            exact = value / self._meaning.period_s
            for periods in dict.fromkeys((round(exact), int(exact) + 1, int(exact))):
                yield from self._freedom.after(periods, at)


def items_of(expr: m.Expr, at_hand: Value) -> Iterator[m.Expr]:
    """The items of a vector or list as expressions; `at_hand` is its value."""
    kind = expr.type
    assert isinstance(kind, (Vector, ListOf))  # what quantifiers range over
    for index in range(len(at_hand)):
        yield m.Component(expr, index, type=kind.element)
