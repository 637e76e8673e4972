"""Which argument has to have which value so that an operation gives a wanted one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from specc.example.values import Value
from specc.expr.evaluate_builtins import compose, inverse, position

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
