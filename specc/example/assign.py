"""Choosing values of inputs and memory so that an expression gets a wanted value."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from specc.example.numbers import SearchBudget
from specc.example.situation import Fields, Meaning, Situation, Value, alike, first_value
from specc.frozen import frozen
from specc.lang.evaluate import compose, inverse, position
from specc.model import expr as m
from specc.model.types import ListOf, Vector
from specc.proof import InputName

# What may be changed in a situation, and how inputs, memory and time are changed.


LONGEST = 100_000
"""Most periods that a scenario waits."""


@frozen
class Freedom:
    """What a search may change.

    Attributes:
        memory: memory elements with these names.
        time: how long the state has been running.
        unsent: inputs that change although nothing comes; otherwise only those of `devices` do.
        sure: inputs that are always there.
        never: inputs that must not come.
    """

    memory: frozenset[str]
    time: bool
    unsent: bool
    devices: frozenset[InputName]
    sure: frozenset[InputName]
    never: frozenset[InputName] = frozenset()

    def input(self, name: InputName, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation with another value of an input."""
        inputs = {**at.inputs, name: value}
        if name in self.never:
            return
        if name in at.fresh or self.unsent or name in self.devices:
            yield replace(at, inputs=inputs, present=at.present | {name})
        if name not in at.fresh:
            came = at.fresh | {name}
            yield replace(at, inputs=inputs, present=at.present | {name}, fresh=came)

    def fresh(self, name: InputName, wanted: bool, at: Situation) -> Iterator[Situation]:
        """The situation where an input has come, or has not."""
        if not wanted:
            yield replace(at, fresh=at.fresh - {name})
        elif name not in self.never:
            yield replace(at, fresh=at.fresh | {name}, present=at.present | {name})

    def present(self, name: InputName, wanted: bool, at: Situation) -> Iterator[Situation]:
        """The situation where an input has a value, or none yet."""
        if wanted and name not in self.never:
            yield from self.fresh(name, True, at)
            if self.unsent:
                yield replace(at, present=at.present | {name})
        if not wanted and name not in self.sure and self.unsent:
            yield replace(at, present=at.present - {name}, fresh=at.fresh - {name})

    def remembered(self, name: str, value: Value, at: Situation) -> Iterator[Situation]:
        """The situation with another value in memory."""
        if name in self.memory:
            yield replace(at, memory={**at.memory, name: value})

    def after(self, periods: int, at: Situation) -> Iterator[Situation]:
        """The situation some periods after the state was entered."""
        if self.time and 1 <= periods <= LONGEST:
            yield replace(at, periods=periods)


# Which argument has to have which value so that an operation gives a wanted one.


Wanted = Iterator[tuple[int, Value]]
"""Indices of arguments, each with a value that it could have."""


def inverted(op: str, value: Value, left: Value, right: Value) -> Wanted:
    """For the operators of arithmetic and of poses; `left` and `right` are the present values."""
    match op:
        case "+":
            yield 0, _each(value, right, lambda v, r: v - r)
            yield 1, _each(value, left, lambda v, a: v - a)
        case "-":
            yield 0, _each(value, right, lambda v, r: v + r)
            yield 1, _each(left, value, lambda a, v: a - v)
        case "*":
            if _is_number(right) and right:
                yield 0, _each(value, right, lambda v, r: v / r)
            if _is_number(left) and left:
                yield 1, _each(value, left, lambda v, a: v / a)
        case "/":
            if _is_number(right):
                yield 0, _each(value, right, lambda v, r: v * r)
        case "@":
            yield 0, compose(value, inverse(right))
            yield 1, compose(inverse(left), value)


def _position(now: Sequence[Value], value: Value) -> Wanted:
    rows = ((*row[:3], p) for row, p in zip(now[0], value, strict=False))
    yield 0, (*rows, (0.0, 0.0, 0.0, 1.0))


def _translation(now: Sequence[Value], value: Value) -> Wanted:
    for index, (old, new) in enumerate(zip(now, position(value), strict=True)):
        if old != new:
            yield index, new


def _norm(now: Sequence[Value], value: Value) -> Wanted:
    """All of it along one axis."""
    for index in range(len(now[0]) if value >= 0 else 0):
        yield 0, tuple(float(value) * (i == index) for i in range(len(now[0])))


def _absolute(now: Sequence[Value], value: Value) -> Wanted:
    if value >= 0:
        yield 0, value
        yield 0, -value


def _root(now: Sequence[Value], value: Value) -> Wanted:
    if value >= 0:
        yield 0, value * value


def _any_argument(now: Sequence[Value], value: Value) -> Wanted:
    for index in range(len(now)):
        yield index, value


BUILTINS: dict[str, Callable[[Sequence[Value], Value], Wanted]] = {
    "inverse": lambda now, value: iter([(0, inverse(value))]),
    "position": _position,
    "translation": _translation,
    "norm": _norm,
    "abs": _absolute,
    "float": lambda now, value: iter([(0, int(value))]),
    "sqrt": _root,
    "min": _any_argument,
    "max": _any_argument,
}
"""For functions of the language, from the present values of the arguments and the wanted result."""


def _each(a: Value, b: Value, operation: Callable[[Any, Any], Value]) -> Value:
    match a, b:
        case tuple(), tuple():
            return tuple(operation(p, q) for p, q in zip(a, b, strict=True))
        case tuple(), _:
            return tuple(operation(p, b) for p in a)
        case _, tuple():
            return tuple(operation(a, q) for q in b)
    return operation(a, b)


def _is_number(value: Value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


# Situations to give an expression a value, by changing one thing that it depends on.


Holding = Callable[[m.Expr, bool, Situation], Iterator[Situation]]
Situations = Iterator[Situation]

_CONDITIONS = (m.Logic, m.Compare, m.Among, m.Quantifier, m.Fresh, m.Present, m.IsNone)


class Assigning:
    """Solves `expression == value` for inputs, memory, results of operators and time."""

    def __init__(
        self, meaning: Meaning, freedom: Freedom, holding: Holding, steps: SearchBudget
    ) -> None:
        """`holding` gives ways to make a condition hold or not; `steps` are left for one search."""
        self._steps = steps
        self._meaning = meaning
        self._freedom = freedom
        self._holding = holding
        self._rules: dict[type, Callable[[Any, Value, Situation], Situations]] = {
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

    def ways(self, expr: m.Expr, value: Value, at: Situation) -> Situations:
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

    def _call(self, call: m.Call, value: Value, at: Situation) -> Situations:
        args = tuple(self._now(arg, at) for arg in call.args)
        others = tuple(a for a in at.answers if not (a[0] == call.operator and alike(a[1], args)))
        yield replace(at, answers=(*others, (call.operator, args, value)))

    def _component(self, expr: m.Component, value: Value, at: Situation) -> Situations:
        whole = list(self._now(expr.value, at))
        whole[expr.index] = value
        yield from self.ways(expr.value, tuple(whole), at)

    def _field(self, expr: m.FieldOf, value: Value, at: Situation) -> Situations:
        whole = self._now(expr.value, at)
        if isinstance(whole, Fields):
            yield from self.ways(expr.value, whole.having(expr.name, value), at)

    def _items(self, expr: m.Items, value: Value, at: Situation) -> Situations:
        """The first item that differs; the others are the next steps' matter."""
        for item, wanted in zip(expr.items, value, strict=False):
            if not alike(self._now(item, at), wanted):
                yield from self.ways(item, wanted, at)
                return

    def _unary(self, expr: m.Unary, value: Value, at: Situation) -> Situations:
        if expr.op == "not":
            yield from self._holding(expr, value, at)
        else:
            negative = tuple(-v for v in value) if isinstance(value, tuple) else -value
            yield from self.ways(expr.operand, negative, at)

    def _binary(self, expr: m.Binary, value: Value, at: Situation) -> Situations:
        left, right = self._now(expr.left, at), self._now(expr.right, at)
        for side, wanted in inverted(expr.op, value, left, right):
            yield from self.ways(expr.left if side == 0 else expr.right, wanted, at)

    def _builtin(self, expr: m.Builtin, value: Value, at: Situation) -> Situations:
        if expr.name == "near":
            yield from self._holding(expr, value, at)
        elif expr.name == "len":
            yield from self._length(expr.args[0], value, at)
        elif expr.name in BUILTINS:
            now = [self._now(arg, at) for arg in expr.args]
            for index, wanted in BUILTINS[expr.name](now, value):
                yield from self.ways(expr.args[index], wanted, at)

    def _length(self, of: m.Expr, value: Value, at: Situation) -> Situations:
        """A list made longer or shorter; vectors have the length of their type."""
        if isinstance(of.type, ListOf) and value >= 0:
            now = self._now(of, at)
            more = (first_value(of.type.element),) * max(0, int(value) - len(now))
            yield from self.ways(of, (*now, *more)[: int(value)], at)

    def _choice(self, expr: m.Choice, value: Value, at: Situation) -> Situations:
        branch = expr.then if self._now(expr.test, at) else expr.otherwise
        yield from self.ways(branch, value, at)
        yield from self._holding(expr.test, not self._now(expr.test, at), at)

    def _clock(self, expr: m.Clock, value: Value, at: Situation) -> Situations:
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
