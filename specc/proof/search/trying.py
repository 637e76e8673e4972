"""Values worth trying in a search, and for how long: near thresholds, or by inverse operations."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from operator import add, mul, sub, truediv

from specc.lang.values import compose, elementwise, inverse, moved, position
from specc.model.expr import COMPARED, Builtin, Compare, Expr, Number, walk
from specc.proof.search.situation import NO_VALUE, Meaning, Situation, Value

# The budget of a search, counted in situations so that it always ends at the same one.


class SearchBudget:
    """A number of situations that may still be looked at."""

    def __init__(self, situations: int) -> None:
        self.left = situations

    def spend(self, situations: int) -> bool:
        """Whether any were left before these."""
        had = self.left > 0
        self.left -= situations
        return had

    @contextmanager
    def some(self, most: int) -> Iterator[SearchBudget]:
        """A part of it; what is spent of it is spent of the whole."""
        given = max(0, min(most, self.left))
        part = SearchBudget(given)
        yield part
        self.left -= given - part.left


# Which numbers are worth trying: those that conditions compare with, and what lies between.


_MOST = 8


class Thresholds:
    """Numbers that some conditions compare with."""

    def __init__(self, conditions: Iterable[Expr], meaning: Meaning, at: Situation) -> None:
        """`at` is any situation; what depends on it counts with the value that it has there."""
        known = {0.0}
        for condition in (*conditions, *meaning.lets.values()):
            for node in walk(condition):
                if isinstance(node, Compare):
                    known |= _numbers((node.left, node.right), meaning, at)
                elif isinstance(node, Builtin) and node.name == "near":
                    known |= _numbers(node.args, meaning, at)
                elif isinstance(node, Number):
                    known |= _numbers((node,), meaning, at)
        self._known = sorted(known)

    def below_or_above(self, op: str, limit: float, *, whole: bool) -> Iterator[float]:
        """Numbers n with `n op limit`, at most eight, the nearest to other thresholds first."""
        found: dict[float, None] = {}
        for number in self._around(limit):
            rounded: float = round(number) if whole else number
            if COMPARED[op](rounded, limit):
                found[rounded] = None
        yield from list(found)[:_MOST]

    def _around(self, limit: float) -> Iterator[float]:
        """Round numbers and the middles of gaps near a threshold, then the next gaps."""
        yield from (limit, limit + 1, limit - 1)
        above = [n for n in self._known if n > limit]
        below = [n for n in reversed(self._known) if n < limit]
        for side in (above, below):
            edges = [limit, *side]
            yield from ((a + b) / 2 for a, b in pairwise(edges))
            yield from side[:2]
            yield edges[-1] + math.copysign(1.0, edges[-1] - limit)
        yield from (limit + 1000, limit - 1000)


def _numbers(parts: Iterable[Expr], meaning: Meaning, at: Situation) -> set[float]:
    found = set()
    for part in parts:
        try:
            value = meaning.value(part, at)
        except NO_VALUE:
            continue
        if isinstance(value, (int, float)) and abs(value) <= sys.float_info.max:
            found.add(float(value))
    return found


# Which argument has to have which value so that an operation gives a wanted one.


Wanted = Iterator[tuple[int, Value]]
"""Indices of arguments, each with a value that it could have."""


def inverted(op: str, value: Value, left: Value, right: Value) -> Wanted:
    """For the operators of arithmetic and of poses; `left` and `right` are the present values."""
    match op:
        case "+":
            yield 0, elementwise(sub, value, right)
            yield 1, elementwise(sub, value, left)
        case "-":
            yield 0, elementwise(add, value, right)
            yield 1, elementwise(sub, left, value)
        case "*":
            if _is_number(right) and right:
                yield 0, elementwise(truediv, value, right)
            if _is_number(left) and left:
                yield 1, elementwise(truediv, value, left)
        case "/":
            if _is_number(right):
                yield 0, elementwise(mul, value, right)
        case "@" if len(value) == len(left) - 1:  # a point
            yield 1, moved(inverse(left), value)
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


def _is_number(value: Value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
