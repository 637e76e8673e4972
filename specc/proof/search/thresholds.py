"""Values worth trying in a search, near thresholds, and for how long."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import pairwise

from specc.lang.builtins import FUNCTIONS
from specc.model.expr import COMPARISONS, Builtin, Compare, Expr, Number, walk
from specc.proof.search.situation import NO_VALUE, Interpreter, Situation

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

    def __init__(self, conditions: Iterable[Expr], meaning: Interpreter, at: Situation) -> None:
        """`at` is any situation; what depends on it counts with the value that it has there."""
        known = {0.0}
        for condition in (*conditions, *meaning.lets.values()):
            for node in walk(condition):
                if isinstance(node, Compare):
                    known |= _numbers((node.left, node.right), meaning, at)
                elif isinstance(node, Builtin) and FUNCTIONS[node.name].compares:
                    known |= _numbers(node.args, meaning, at)
                elif isinstance(node, Number):
                    known |= _numbers((node,), meaning, at)
        self._known = sorted(known)

    def below_or_above(self, op: str, limit: float, *, whole: bool) -> Iterator[float]:
        """Numbers n with `n op limit`, at most eight, the nearest to other thresholds first."""
        found: dict[float, None] = {}
        for number in self._around(limit):
            rounded: float = round(number) if whole else number
            if COMPARISONS[op](rounded, limit):
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


def _numbers(parts: Iterable[Expr], meaning: Interpreter, at: Situation) -> set[float]:
    found = set()
    for part in parts:
        try:
            value = meaning.value(part, at)
        except NO_VALUE:
            continue
        if isinstance(value, (int, float)) and abs(value) <= sys.float_info.max:
            found.add(float(value))
    return found
