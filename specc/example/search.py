"""Finding a situation that meets goals: repair what is not met, whatever mends most first."""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence

from specc.example.conditions import MOST_WAYS, Conditions, conjuncts
from specc.example.freedom import Freedom
from specc.example.numbers import Thresholds
from specc.example.patience import Patience
from specc.example.situation import Meaning, Situation
from specc.model.expr import Expr, Fresh, Input, Present
from specc.model.types import Bool
from specc.proof import InputName

Goal = tuple[Expr, bool]
"""A condition and whether it is to hold."""

STARTS, REPAIRS = 6, 40
_ALL = STARTS * REPAIRS * (1 + MOST_WAYS)
_STRAYING = 0.15
"""How often a repair is taken that is not the best one, which leads out of circles."""


def present(name: InputName) -> Goal:
    """An input has a value."""
    peer, element = name
    return Present(Input(peer, element, type=Bool()), type=Bool()), True


def came(name: InputName) -> Goal:
    """A value of an input has come."""
    peer, element = name
    return Fresh(Input(peer, element, type=Bool()), type=Bool()), True


def find(
    meaning: Meaning,
    start: Situation,
    goals: Iterable[Goal],
    freedom: Freedom,
    patience: Patience | None = None,
) -> Situation | None:
    """A situation near `start` that meets all goals; None if none was found.

    The same question always has the same answer, with the same patience.
    """
    patience = patience or Patience(_ALL)
    wanted = [part for goal in goals for part in conjuncts(*goal, meaning)]
    if not _unmet(meaning, wanted, start):
        return start
    thresholds = Thresholds([condition for condition, _ in wanted], meaning, start)
    conditions = Conditions(meaning, freedom, thresholds)
    for seed in range(STARTS):
        rng = random.Random(seed)
        found = _repaired(meaning, start, wanted, conditions, rng, patience)
        if found is not None:
            return found
    return None


def _repaired(
    meaning: Meaning,
    start: Situation,
    wanted: Sequence[Goal],
    conditions: Conditions,
    rng: random.Random,
    patience: Patience,
) -> Situation | None:
    at = start
    for _ in range(REPAIRS):
        unmet = _unmet(meaning, wanted, at)
        if not unmet:
            return at
        ways = conditions.some_ways(*rng.choice(unmet), at)
        if not patience.spend(1 + len(ways)):
            return None
        if not ways:
            continue
        scores = [len(_unmet(meaning, wanted, way)) for way in ways]
        at = rng.choice(ways) if rng.random() < _STRAYING else ways[scores.index(min(scores))]
    return None


def _unmet(meaning: Meaning, wanted: Sequence[Goal], at: Situation) -> list[Goal]:
    return [goal for goal in wanted if meaning.holds(goal[0], at) is not goal[1]]
