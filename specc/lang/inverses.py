"""Which argument has to have which value so that an operation gives a wanted one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from specc.lang.kind import Value
from specc.lang.kinds import first_value
from specc.lang.values import compose, inverse, position, translation
from specc.model.types import Int, ListOf, Pose, Type

Wanted = Iterator[tuple[int, Value]]
"""Indices of arguments, each with a value that it could have."""
Inverse = Callable[[Sequence[Type], Sequence[Value], Value], Wanted]
"""From types and present values of the arguments of a function, and the result that is wanted."""


def of_inverse(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`inverse(X)`."""
    yield 0, inverse(value)


def of_position(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`position(X)`."""
    rows = ((*row[:3], p) for row, p in zip(now[0], value, strict=False))
    yield 0, (*rows, (0.0, 0.0, 0.0, 1.0))


def of_translation(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`translation(x, y, z)`."""
    for index, (old, new) in enumerate(zip(now, position(value), strict=True)):
        if old != new:
            yield index, new


def of_len(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """A list made longer or shorter; vectors have the length of their type."""
    of, items = types[0], now[0]
    if isinstance(of, ListOf) and value >= 0:
        more = (first_value(of.element),) * max(0, int(value) - len(items))
        yield 0, (*items, *more)[: int(value)]


def of_norm(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """All of it along one axis."""
    for index in range(len(now[0]) if value >= 0 else 0):
        yield 0, tuple(float(value) * (i == index) for i in range(len(now[0])))


def of_abs(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`abs(a)`."""
    if value >= 0:
        yield 0, value
        yield 0, -value


def of_sqrt(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`sqrt(a)`."""
    if value >= 0:
        yield 0, value * value


def of_float(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """An integer in the place of a real."""
    yield 0, int(value)


def any_argument(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """Each argument in turn, of a function that chooses one of them."""
    for index in range(len(now)):
        yield index, value


def of_hypot(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`hypot(a, b)`, by what it lies above the other one; else all of it along the first axis."""
    for index, other in ((0, now[1]), (1, now[0])):
        if value >= abs(other):
            yield index, math.sqrt(value - other) * math.sqrt(value + other)
    if value >= 0:
        yield 0, value


def of_sign(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`sign(a)`."""
    yield 0, _typed(types[0], value * max(1, abs(now[0])))


def of_whole(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`floor(a)` and `round(a)`."""
    yield 0, _typed(types[0], value)


def of_wrap_angle(types: Sequence[Type], now: Sequence[Value], value: Value) -> Wanted:
    """`wrap_angle(a)`."""
    if -math.pi <= value < math.pi:
        yield 0, value


def _typed(type_: Type, number: float) -> float:
    return int(number) if isinstance(type_, Int) else float(number)


def of_near(types: Sequence[Type], now: Sequence[Value], wanted: Value) -> Wanted:
    """`near`, of numbers, vectors and poses."""
    a, b, tolerance, *_ = now
    for side, other in ((0, b), (1, a)):
        for value in _distant(other, types[side], tolerance, wanted):
            yield side, value
    if not isinstance(types[0], Pose):
        gap = abs(a - b) if not isinstance(a, tuple) else math.dist(a, b)
        yield 2, gap + 1.0 if wanted else gap / 2


def _distant(other: Value, side: Type, tolerance: float, wanted: bool) -> Iterator[Value]:
    """Values that are near another one, or not."""
    if wanted:
        yield other
    steps = (0.5, -0.5) if wanted else (2.0, -2.0, 1000.0)
    for step in (tolerance * n + (0 if wanted else n) for n in steps):
        if isinstance(side, Pose):
            yield compose(other, translation(step, 0.0, 0.0))
        elif isinstance(other, tuple):
            yield (other[0] + step, *other[1:])
        else:
            yield other + step
