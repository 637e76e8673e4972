"""The search for a situation in which conditions have wanted outcomes."""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice, pairwise
from typing import Any

from specc.lang.builtins import FUNCTIONS
from specc.lang.kinds import first_value, kind, other_values
from specc.lang.values import SIGNS, Fields, Value, is_close
from specc.model import expr as m
from specc.model.expr import Expr
from specc.model.fsm import Cause, mode_of
from specc.model.system import Subsystem
from specc.model.types import Bool, Enum, ListOf, OptionalOf, Text, Vector
from specc.search.situation import (
    NO_VALUE,
    FreeVariables,
    Interpreter,
    Situation,
    runnable,
    values_of_type,
)


class SearchBudget:
    """How many more situations may be looked at: counted, so that a search always ends at one."""

    def __init__(self, situations: int) -> None:
        self.remaining = situations

    def spend(self, situations: int) -> bool:
        """Spend situations; returns whether any were left before."""
        had = self.remaining > 0
        self.remaining -= situations
        return had

    @contextmanager
    def share(self, most: int) -> Iterator[SearchBudget]:
        """A part of the budget; spending from the part spends from the whole."""
        given = max(0, min(most, self.remaining))
        part = SearchBudget(given)
        yield part
        self.remaining -= given - part.remaining


MOST_NEAR = 8


class Thresholds:
    """Numbers that some conditions compare with."""

    def __init__(self, conditions: Iterable[Expr], meaning: Interpreter, at: Situation) -> None:
        """`at` is any situation; what depends on it counts with the value that it has there."""
        known = {0.0}
        for condition in (*conditions, *meaning.lets.values()):
            for node in m.walk(condition):
                if isinstance(node, m.Compare):
                    known |= _numbers((node.left, node.right), meaning, at)
                elif isinstance(node, m.Builtin) and FUNCTIONS[node.name].compares:
                    known |= _numbers(node.args, meaning, at)
                elif isinstance(node, m.Number):
                    known |= _numbers((node,), meaning, at)
        self._numbers = sorted(known)

    def below_or_above(self, op: str, limit: float, *, is_integer: bool) -> Iterator[float]:
        """Numbers n with `n op limit`, at most eight, the nearest to other thresholds first."""
        found: dict[float, None] = {}
        for number in self._around(limit):
            rounded: float = round(number) if is_integer else number
            if m.COMPARISONS[op](rounded, limit):
                found[rounded] = None
        yield from list(found)[:MOST_NEAR]

    def _around(self, limit: float) -> Iterator[float]:
        """Round numbers and the middles of gaps near a threshold, then the next gaps."""
        yield from (limit, limit + 1, limit - 1)
        above = [n for n in self._numbers if n > limit]
        below = [n for n in reversed(self._numbers) if n < limit]
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


# Situations in which an expression has a wanted value: one thing that it depends on is changed.


Situations = Iterator[Situation]

MOST_SITUATIONS = 60
MOST_STEPS = 1000
"""Parts of expressions that the search for the situations of one condition looks at."""
_OTHER_TEXT = "something else"


class Inverter:
    """Solves `expression == value` for inputs, memory, results of operators and time."""

    def __init__(
        self, meaning: Interpreter, freedom: FreeVariables, thresholds: Thresholds
    ) -> None:
        self._meaning = meaning
        self._thresholds = thresholds
        self._steps = SearchBudget(MOST_STEPS)
        self._freedom = freedom
        self._rules: dict[type, Callable[[Any, Value, Situation], Situations]] = {
            m.Input: self._of_type(lambda e, v, at: freedom.with_input(e.key, v, at)),
            m.Fresh: lambda e, v, at: freedom.with_freshness(e.input.key, v, at),
            m.Present: lambda e, v, at: freedom.with_presence(e.input.key, v, at),
            m.Lag: self._of_type(freedom.with_lag),
            m.Live: self._of_type(freedom.with_live),
            m.MemoryRef: self._of_type(lambda e, v, at: freedom.with_memory(e.name, v, at)),
            m.LetRef: lambda e, v, at: self.situations(meaning.lets[e.name], v, at),
            m.ConstantRef: lambda e, v, at: self.situations(meaning.constants[e.name], v, at),
            m.Unwrap: lambda e, v, at: self.situations(e.value, v, at),
            m.Call: self._call,
            m.Binary: self._binary,
            m.Builtin: self._builtin,
            m.Clock: self._clock,
            m.Compare: self._compare,
            m.IsOneOf: self._among,
            m.Quantifier: self._quantifier,
        }

    def first_situations(self, expr: m.Expr, wanted: bool, at: Situation) -> list[Situation]:
        """A bounded number of situations; none if the value cannot be computed."""
        self._steps.remaining = MOST_STEPS
        try:
            return list(islice(self.situations(expr, wanted, at), MOST_SITUATIONS))
        except NO_VALUE:
            return []

    def situations(self, expr: m.Expr, value: Value, at: Situation) -> Situations:
        """Situations in which the expression may have the value; a condition, in which it holds."""
        if self._steps.spend(1):
            yield from self._rules.get(type(expr), self._of_part)(expr, value, at)

    def _value(self, expr: m.Expr, at: Situation) -> Value:
        return self._meaning.value(expr, at)

    def _of_type(
        self, change: Callable[[Any, Value, Situation], Situations]
    ) -> Callable[[Any, Value, Situation], Situations]:
        """A rule that changes a leaf only to values of its type."""

        def rule(leaf: m.Expr, value: Value, at: Situation) -> Situations:
            for typed in values_of_type(leaf.type, value):
                yield from change(leaf, typed, at)

        return rule

    def _call(self, call: m.Call, value: Value, at: Situation) -> Situations:
        """A result of an operator; for other arguments a predicate may give something else."""
        for result in values_of_type(call.type, value):
            yield self._with_answer(call, result, at)
        for arg in call.args if isinstance(call.type, Bool) else ():
            for other in other_values(self._value(arg, at), arg.type):
                for moved in self.situations(arg, other, at):
                    yield self._with_answer(call, value, moved)

    def _with_answer(self, call: m.Call, value: Value, at: Situation) -> Situation:
        args = tuple(self._value(arg, at) for arg in call.args)
        known = tuple(a for a in at.answers if not (a[0] == call.operator and is_close(a[1], args)))
        return replace(at, answers=(*known, (call.operator, args, value)))

    def _of_part(self, expr: m.Expr, value: Value, at: Situation) -> Situations:
        """Change one part of an expression whose other parts can stay as they are."""
        match expr:
            case m.Component(value=vector, index=index):
                components = list(self._value(vector, at))
                components[index : index + 1] = [value]  # also where a list has no item yet
                yield from self.situations(vector, tuple(components), at)
            case m.FieldOf(value=record, name=name):
                fields = self._value(record, at)
                if isinstance(fields, Fields):
                    yield from self.situations(record, fields.with_field(name, value), at)
            case m.Items(items=items):
                # The first item that differs; the next steps change the others.
                for item, wanted in zip(items, value, strict=False):
                    if not is_close(self._value(item, at), wanted):
                        yield from self.situations(item, wanted, at)
                        return
            case m.Unary(op="not", operand=operand):
                yield from self.situations(operand, not value, at)
            case m.Unary(operand=operand):
                negative = tuple(-v for v in value) if isinstance(value, tuple) else -value
                yield from self.situations(operand, negative, at)
            case m.Choice(test=test, then=then, otherwise=otherwise):
                holds = bool(self._meaning.holds(test, at))
                yield from self.situations(then if holds else otherwise, value, at)
                yield from self.situations(test, not holds, at)
            case m.Logic(operands=operands):
                for operand in operands:
                    if self._meaning.holds(operand, at) is not value:
                        yield from self.situations(operand, value, at)
            case m.IsNone(value=optional):
                assert isinstance(optional.type, OptionalOf)  # typing guarantees it
                wanted = None if value else first_value(optional.type.value)
                yield from self.situations(optional, wanted, at)

    def _binary(self, expr: m.Binary, value: Value, at: Situation) -> Situations:
        left, right = self._value(expr.left, at), self._value(expr.right, at)
        sides = ((expr.left, right), (expr.right, left))
        for (side, other), undo in zip(sides, SIGNS[expr.op].inverse, strict=True):
            if undo and (wanted := undo(value, other)) is not None:
                yield from self.situations(side, wanted, at)

    def _builtin(self, expr: m.Builtin, value: Value, at: Situation) -> Situations:
        inverse = FUNCTIONS[expr.name].inverse
        if inverse is not None:
            now = [self._value(arg, at) for arg in expr.args]
            for index, wanted in inverse([arg.type for arg in expr.args], now, value):
                yield from self.situations(expr.args[index], wanted, at)

    def _clock(self, expr: m.Clock, value: Value, at: Situation) -> Situations:
        if expr.name == "elapsed":
            exact = value / self._meaning.period_s
            for periods in dict.fromkeys((round(exact), int(exact) + 1, int(exact))):
                yield from self._freedom.wait(periods, at)

    def _compare(self, expr: m.Compare, wanted: bool, at: Situation) -> Situations:
        op = expr.op if wanted else m.OPPOSITES[expr.op]
        left, right = self._value(expr.left, at), self._value(expr.right, at)
        for side, other, how in (
            (expr.left, right, op),
            (expr.right, left, m.MIRRORED[op]),
        ):
            for value in self._values(side, how, other):
                yield from self.situations(side, value, at)

    def _values(self, side: m.Expr, op: str, other: Value) -> Iterable[Value]:
        """Values of a side that are in a relation to the other side's."""
        sort = kind(side.type).sort
        is_time = isinstance(side, m.Clock) or (
            isinstance(side, m.LetRef) and bool(mode_of("elapsed", side.name))
        )
        if is_time and sort == "real":
            period, whole = self._meaning.period_s, int(other / self._meaning.period_s)
            near = (n * period for n in (whole, whole + 1, whole - 1, whole + 2))
            return [time for time in near if m.COMPARISONS[op](time, other)]
        if sort in ("whole", "real"):
            return self._thresholds.below_or_above(op, other, is_integer=sort == "whole")
        if isinstance(side.type, Text):
            return (other,) if op == "==" else (_OTHER_TEXT,)
        return (other,) if op == "==" else other_values(other, side.type)

    def _among(self, expr: m.IsOneOf, wanted: bool, at: Situation) -> Situations:
        assert isinstance(expr.item.type, Enum)  # typing guarantees it
        for member in expr.item.type.members:
            if (member in expr.members) is wanted:
                yield from self.situations(expr.item, member, at)

    def _quantifier(self, expr: m.Quantifier, wanted: bool, at: Situation) -> Situations:
        items = self._value(expr.over, at)
        assert isinstance(expr.over.type, (Vector, ListOf))  # what quantifiers range over
        element = expr.over.type.element
        parts = (m.Component(expr.over, index, type=element) for index in range(len(items)))
        bodies = [m.instantiate(expr.body, expr.variable, part) for part in parts]
        for body in bodies:
            if self._meaning.holds(body, at) is not wanted:
                yield from self.situations(body, wanted, at)
        if not isinstance(expr.over.type, ListOf):
            return
        if (expr.kind == "any") == wanted:
            longer = (*items, first_value(expr.over.type.element))
            yield from self.situations(expr.over, longer, at)
        else:
            yield from self.situations(expr.over, (), at)


def conjuncts(expr: m.Expr, wanted: bool, meaning: Interpreter) -> list[tuple[m.Expr, bool]]:
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


# Finding a situation that meets goals: repair what is not met, whatever mends most first.


Goal = tuple[Expr, bool]
"""A condition and whether it is to hold."""

STARTS, REPAIRS = 6, 40
_ALL = STARTS * REPAIRS * (1 + MOST_SITUATIONS)
_RANDOM_STEP = 0.15
"""The probability of a random repair, which leaves local optima."""


def refutation_goals(
    subsystem: Subsystem,
    state: str,
    cause: Cause,
    holding: Collection[int],
    answers: Iterable[Goal] = (),
) -> Iterator[tuple[Goal, ...]]:
    """Yields sets of goals under which the rows `holding` apply when a state ends by a cause.

    In the first set all other rows are false. In the second one they are open; there is none if
    `holding` is empty or has all rows. The assumptions hold, and questions have these `answers`.
    """
    given = [*reversed(subsystem.state(state).behaviour.facts_after(cause))]
    given += [(axiom.that, True) for axiom in subsystem.axioms]
    given += answers
    rows = [row.condition.when for _, row in subsystem.rows(state, cause)]
    row_goals = [(when, index in holding) for index, when in enumerate(rows)]
    yield _runnable([*given, *row_goals])
    if len(rows) > len(holding) > 0:
        yield _runnable([*given, *(goal for goal in row_goals if goal[1])])


def _runnable(goals: Sequence[Goal]) -> tuple[Goal, ...]:
    return tuple((runnable(condition), yes) for condition, yes in goals)


def find(
    meaning: Interpreter,
    start: Situation,
    goals: Iterable[Goal],
    freedom: FreeVariables,
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
    conditions = Inverter(meaning, freedom, thresholds)
    for seed in range(STARTS):
        rng = random.Random(seed)
        found = _repair(meaning, start, wanted, conditions, rng, budget)
        if found is not None:
            return found
    return None


def _repair(
    meaning: Interpreter,
    start: Situation,
    wanted: Sequence[Goal],
    conditions: Inverter,
    rng: random.Random,
    budget: SearchBudget,
) -> Situation | None:
    at = start
    for _ in range(REPAIRS):
        unmet = _unmet(meaning, wanted, at)
        if not unmet:
            return at
        situations = conditions.first_situations(*rng.choice(unmet), at)
        if not budget.spend(1 + len(situations)):
            return None
        if not situations:
            continue
        scores = [len(_unmet(meaning, wanted, each)) for each in situations]
        at = (
            rng.choice(situations)
            if rng.random() < _RANDOM_STEP
            else situations[scores.index(min(scores))]
        )
    return None


def _unmet(meaning: Interpreter, wanted: Sequence[Goal], at: Situation) -> list[Goal]:
    return [goal for goal in wanted if meaning.holds(goal[0], at) is not goal[1]]
