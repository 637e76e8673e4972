"""The search for a situation in which conditions have wanted outcomes."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from itertools import islice
from typing import Any

from specc.example.assign import Assigning, Freedom, Situations, items_of
from specc.example.numbers import HOLDS, SearchBudget, Thresholds, runnable
from specc.example.situation import NO_VALUE, Meaning, Situation, Value, first_value, others
from specc.lang.evaluate import compose, translation
from specc.model import expr as m
from specc.model.expr import Expr, Fresh, Input, Present
from specc.model.fsm import Cause
from specc.model.system import Subsystem
from specc.model.types import Bool, Enum, Int, ListOf, OptionalOf, Pose, Text
from specc.proof import InputName

# Ways to make a condition hold or fail, by changing one thing that it depends on.


MOST_WAYS = 60
MOST_STEPS = 1000
"""Parts of expressions that are looked at for the ways of one condition."""
_OPPOSITES = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}
_OTHER_TEXT = "something else"


class Conditions:
    """Finds situations near a given one in which a condition has a truth value."""

    def __init__(self, meaning: Meaning, freedom: Freedom, thresholds: Thresholds) -> None:
        self._meaning = meaning
        self._freedom = freedom
        self._thresholds = thresholds
        self._steps = SearchBudget(MOST_STEPS)
        self._assigning = Assigning(meaning, freedom, self.ways, self._steps)
        self._rules: dict[type, Callable[[Any, bool, Situation], Situations]] = {
            m.Unary: lambda e, wanted, at: self.ways(e.operand, not wanted, at),
            m.LetRef: lambda e, wanted, at: self.ways(meaning.lets[e.name], wanted, at),
            m.Logic: self._logic,
            m.Choice: self._choice,
            m.Compare: self._compare,
            m.Among: self._among,
            m.Quantifier: self._quantifier,
            m.Fresh: lambda e, wanted, at: freedom.fresh(_name(e.input), wanted, at),
            m.Present: lambda e, wanted, at: freedom.present(_name(e.input), wanted, at),
            m.Builtin: self._near,
            m.IsNone: self._none,
            m.Call: self._call,
        }

    def some_ways(self, expr: m.Expr, wanted: bool, at: Situation) -> list[Situation]:
        """A bounded number of ways; none if its value cannot be computed."""
        self._steps.left = MOST_STEPS
        try:
            return list(islice(self.ways(expr, wanted, at), MOST_WAYS))
        except NO_VALUE:
            return []

    def ways(self, expr: m.Expr, wanted: bool, at: Situation) -> Situations:
        """Situations in which the condition may hold, or fail, as `wanted`."""
        if self._steps.spend(1):
            rule = self._rules.get(type(expr), self._give)
            yield from rule(expr, wanted, at)

    def _give(self, expr: m.Expr, value: Value, at: Situation) -> Situations:
        yield from self._assigning.ways(expr, value, at)

    def _call(self, call: m.Call, wanted: bool, at: Situation) -> Situations:
        """A result of an operator; for other arguments it may give something else."""
        yield from self._give(call, wanted, at)
        for arg in call.args:
            for value in others(self._meaning.value(arg, at), arg.type):
                for moved in self._give(arg, value, at):
                    yield from self._give(call, wanted, moved)

    def _none(self, expr: m.IsNone, wanted: bool, at: Situation) -> Situations:
        assert isinstance(expr.value.type, OptionalOf)  # typing guarantees it
        value = None if wanted else first_value(expr.value.type.value)
        yield from self._give(expr.value, value, at)

    def _logic(self, expr: m.Logic, wanted: bool, at: Situation) -> Situations:
        for operand in expr.operands:
            if self._meaning.holds(operand, at) is not wanted:
                yield from self.ways(operand, wanted, at)

    def _choice(self, expr: m.Choice, wanted: bool, at: Situation) -> Situations:
        test = bool(self._meaning.holds(expr.test, at))
        yield from self.ways(expr.then if test else expr.otherwise, wanted, at)
        yield from self.ways(expr.test, not test, at)

    def _compare(self, expr: m.Compare, wanted: bool, at: Situation) -> Situations:
        op = expr.op if wanted else _OPPOSITES[expr.op]
        left, right = self._meaning.value(expr.left, at), self._meaning.value(expr.right, at)
        for side, other, how in (
            (expr.left, right, op),
            (expr.right, left, _MIRRORED[op]),
        ):
            for value in self._values(side, how, other):
                yield from self._give(side, value, at)

    def _values(self, side: m.Expr, op: str, other: Value) -> Iterable[Value]:
        """Values of a side that are in a relation to the other side's."""
        kind = side.type
        if isinstance(kind, Bool):
            return (other,) if op == "==" else (not other,)
        if isinstance(kind, Enum):
            return [member for member in kind.members if (member == other) == (op == "==")]
        if isinstance(side, m.Clock):
            period, whole = self._meaning.period_s, int(other / self._meaning.period_s)
            near = (n * period for n in (whole, whole + 1, whole - 1, whole + 2))
            return [time for time in near if HOLDS[op](time, other)]
        if isinstance(other, (int, float)):
            return self._thresholds.below_or_above(op, other, whole=isinstance(kind, Int))
        if isinstance(kind, Text):
            return (other,) if op == "==" else (_OTHER_TEXT,)
        return (other,) if op == "==" else others(other, kind)

    def _among(self, expr: m.Among, wanted: bool, at: Situation) -> Situations:
        assert isinstance(expr.item.type, Enum)  # typing guarantees it
        for member in expr.item.type.members:
            if (member in expr.members) is wanted:
                yield from self._give(expr.item, member, at)

    def _quantifier(self, expr: m.Quantifier, wanted: bool, at: Situation) -> Situations:
        items = self._meaning.value(expr.over, at)
        bodies = [m.instance(expr.body, expr.variable, i) for i in items_of(expr.over, items)]
        for body in bodies:
            if self._meaning.holds(body, at) is not wanted:
                yield from self.ways(body, wanted, at)
        if not isinstance(expr.over.type, ListOf):
            return
        if (expr.kind == "any") == wanted:
            longer = (*items, first_value(expr.over.type.element))
            yield from self._give(expr.over, longer, at)
        else:
            yield from self._give(expr.over, (), at)

    def _near(self, expr: m.Builtin, wanted: bool, at: Situation) -> Situations:
        a, b, tolerance, *_ = (self._meaning.value(arg, at) for arg in expr.args)
        for side, other in ((expr.args[0], b), (expr.args[1], a)):
            for value in self._distant(other, side, tolerance, wanted):
                yield from self._give(side, value, at)
        if not isinstance(expr.args[0].type, Pose):
            gap = abs(a - b) if not isinstance(a, tuple) else math.dist(a, b)
            yield from self._give(expr.args[2], gap + 1.0 if wanted else gap / 2, at)

    def _distant(
        self, other: Value, side: m.Expr, tolerance: float, wanted: bool
    ) -> Iterator[Value]:
        """Values that are near another one, or not."""
        if wanted:
            yield other
        steps = (0.5, -0.5) if wanted else (2.0, -2.0, 1000.0)
        for step in (tolerance * n + (0 if wanted else n) for n in steps):
            if isinstance(side.type, Pose):
                yield compose(other, translation(step, 0.0, 0.0))
            elif isinstance(other, tuple):
                yield (other[0] + step, *other[1:])
            else:
                yield other + step


def conjuncts(expr: m.Expr, wanted: bool, meaning: Meaning) -> list[tuple[m.Expr, bool]]:
    """What must hold or fail together so that a condition does; what a let says counts once."""
    found: list[tuple[m.Expr, bool]] = []
    open_, seen = [(expr, wanted)], set[tuple[str, bool]]()
    while open_:
        part, holds = open_.pop()
        match part:
            case m.Truth(value=value) if value is holds:
                pass
            case m.LetRef(name=name):
                if (name, holds) not in seen:
                    seen.add((name, holds))
                    open_.append((meaning.lets[name], holds))
            case m.Unary(op="not", operand=operand):
                open_.append((operand, not holds))
            case m.Logic(op=op, operands=operands) if (op == "and") is holds:
                open_ += [(operand, holds) for operand in reversed(operands)]
            case _:
                found.append((part, holds))
    return found


def _name(element: m.Input) -> tuple[str, str]:
    return element.peer, element.element


# Finding a situation that meets goals: repair what is not met, whatever mends most first.


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


def showing(
    subsystem: Subsystem,
    state: str,
    cause: Cause,
    holding: Collection[int],
    answers: Iterable[Goal] = (),
) -> Iterator[tuple[Goal, ...]]:
    """Goals of a situation in which a state ends by a cause and of its rows `holding` apply.

    The assumptions hold, and questions have these `answers`. At first no other rows apply; then, if
    any have to, others may as well.
    """
    behaviour = subsystem.state(state).behaviour
    given = [(behaviour.error.when, cause == "error")]
    if cause == "terminal":
        given.append((behaviour.terminal.when, True))
    given += [(axiom.that, True) for axiom in subsystem.axioms]
    given += answers
    rows = [row.condition.when for _, row in subsystem.rows(state, cause)]
    held = [(when, index in holding) for index, when in enumerate(rows)]
    yield _runnable([*given, *held])
    if len(rows) > len(holding) > 0:
        yield _runnable([*given, *(goal for goal in held if goal[1])])


def _runnable(goals: Sequence[Goal]) -> tuple[Goal, ...]:
    return tuple((runnable(condition), yes) for condition, yes in goals)


def find(
    meaning: Meaning,
    start: Situation,
    goals: Iterable[Goal],
    freedom: Freedom,
    budget: SearchBudget | None = None,
) -> Situation | None:
    """A situation near `start` that meets all goals; None if none was found.

    The same question always has the same answer, with the same budget.
    """
    budget = budget or SearchBudget(_ALL)
    wanted = [part for goal in goals for part in conjuncts(*goal, meaning)]
    if not _unmet(meaning, wanted, start):
        return start
    thresholds = Thresholds([condition for condition, _ in wanted], meaning, start)
    conditions = Conditions(meaning, freedom, thresholds)
    for seed in range(STARTS):
        rng = random.Random(seed)
        found = _repaired(meaning, start, wanted, conditions, rng, budget)
        if found is not None:
            return found
    return None


def _repaired(
    meaning: Meaning,
    start: Situation,
    wanted: Sequence[Goal],
    conditions: Conditions,
    rng: random.Random,
    budget: SearchBudget,
) -> Situation | None:
    at = start
    for _ in range(REPAIRS):
        unmet = _unmet(meaning, wanted, at)
        if not unmet:
            return at
        ways = conditions.some_ways(*rng.choice(unmet), at)
        if not budget.spend(1 + len(ways)):
            return None
        if not ways:
            continue
        scores = [len(_unmet(meaning, wanted, way)) for way in ways]
        at = rng.choice(ways) if rng.random() < _STRAYING else ways[scores.index(min(scores))]
    return None


def _unmet(meaning: Meaning, wanted: Sequence[Goal], at: Situation) -> list[Goal]:
    return [goal for goal in wanted if meaning.holds(goal[0], at) is not goal[1]]
