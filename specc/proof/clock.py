"""Comparisons with the time in a state or mode: periods at which the answer changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple

from specc.lang.builtins import FUNCTIONS
from specc.lang.evaluate import operation_of
from specc.lang.kinds import kind
from specc.lang.ranges import Operation, Range
from specc.limits import spend
from specc.model.expr import (
    Binary,
    Builtin,
    Call,
    Choice,
    Clock,
    Compare,
    Component,
    ConstantRef,
    Expr,
    IsNone,
    IsOneOf,
    LazyByDependence,
    LetRef,
    Logic,
    MemoryRef,
    Number,
    Truth,
    Unary,
    children,
)
from specc.model.fsm import mode_of
from specc.model.types import Bool, Real
from specc.model.units import SECOND
from specc.proof.numbering import Numbering

LONGEST = 2**40
"""Periods that no state lasts; later ones are not asked about."""
MOST_STEPS = 50_000
"""Operations that are computed for one condition."""

ELAPSED = Clock("elapsed", type=Real(SECOND))


def asks_entry(expr: Expr) -> bool:
    """Whether it asks for the first period in a state or mode: no condition is evaluated there."""
    if isinstance(expr, MemoryRef):
        return bool(mode_of("entered", expr.name))
    return isinstance(expr, Clock) and expr.name == "entered"


Timing = Literal["", "followed", "not followed"]
"""Whether the time in a state is asked for, and whether proofs follow what is computed from it."""


class _Step(NamedTuple):
    """How a value is computed from others; the time in a state has no operation."""

    operation: Operation | None
    parts: tuple[int, ...]


class UndecidedError(Exception):
    """The ranges of values do not decide a condition."""


@dataclass(frozen=True, slots=True)
class TurningPoints:
    """Whether a condition holds at first, and the periods at which that changes."""

    first: bool
    at: tuple[int, ...]


class Timer:
    """Evaluates conditions over time and constants, rounded as generated code rounds.

    It bisects ranges of periods until interval arithmetic decides each of them.
    """

    def __init__(self, numbering: Numbering, counter: str = "") -> None:
        """Time is `elapsed`, from the first period on, or the memory `counter`, from 0 on."""
        self._numbering, self._counter = numbering, counter
        # All by value number. Parts have smaller numbers than what is computed from them.
        self._constant_ranges: dict[int, Range] = {}
        self._steps: dict[int, _Step] = {}
        self._undetermined: set[int] = set()
        self._timings: dict[int, Timing] = {}
        self._turns: dict[int, TurningPoints | None] = {}
        lets = numbering.lets
        self._conditions_of_lets = LazyByDependence(
            lets, lambda name: self.timed_conditions(lets[name])
        )
        for value in numbering.named_values():
            self._register(value)
            self._timing(value)

    def turning_points(self, condition: Expr) -> TurningPoints | None:
        """When a condition changes.

        None if it depends on more than time, or if ranges of values do not decide it.
        """
        number = self._numbering.number(condition)
        self._register(condition)
        is_timed = self._counter or self._numbering.exact_period_s is not None
        if not is_timed or number not in self._steps:
            return None
        if number not in self._turns:
            try:
                self._turns[number] = self._bisect(self._steps_to(number))
            except (ArithmeticError, UndecidedError):
                self._turns[number] = None
        return self._turns[number]

    def turning_periods(self, expr: Expr) -> frozenset[int]:
        """Periods at which conditions in an expression, or in its lets, change with time alone."""
        return frozenset(
            period for _, found in self.timed_conditions(expr).values() for period in found.at
        )

    def timed_conditions(self, expr: Expr) -> dict[int, tuple[Expr, TurningPoints]]:
        """The conditions in an expression, or in its lets, that time alone decides, by identity."""
        if isinstance(expr, LetRef) and expr.name in self._conditions_of_lets:
            return self._conditions_of_lets[expr.name]
        is_asked = isinstance(expr.type, Bool) and not isinstance(expr, (Truth, ConstantRef))
        if is_asked and (turns := self.turning_points(expr)) is not None:
            return {id(expr): (expr, turns)}
        found: dict[int, tuple[Expr, TurningPoints]] = {}
        for part in children(expr):
            found |= self.timed_conditions(part)
        return found

    def elapsed_condition(self, op: Literal["<", "<=", "=="], periods: int) -> Expr:
        """The condition that the state has lasted fewer periods, or as many."""
        assert self._numbering.exact_period_s is not None  # there are turns
        time_s = float(periods * self._numbering.exact_period_s)
        return Compare(op, ELAPSED, Number(time_s, type=ELAPSED.type), type=Bool())

    def is_unsure(self, condition: Expr) -> bool:
        """Whether a run may compute another value from the time than proofs do."""
        if self._numbering.exact_period_s is None:
            return False
        if self._register(condition):
            return self._timing(condition) != "" and self.turning_points(condition) is None
        return self._timing(condition) == "not followed"

    def _bisect(self, steps: Sequence[int]) -> TurningPoints:
        found: list[tuple[int, bool]] = []
        open_, left = [(0 if self._counter else 1, LONGEST)], MOST_STEPS
        while open_:
            early, late = open_.pop()
            left -= len(steps)
            if left < 0 or not spend("proof", len(steps)):
                raise UndecidedError
            least, greatest = self._truth_over(steps, early, late)
            if least == greatest:
                found.append((early, bool(least)))
            elif early == late:
                raise UndecidedError
            else:
                # A turn at n takes log n ranges.
                middle = min(2 * early, (early + late) // 2)
                open_ += [(middle + 1, late), (early, middle)]
        turns = [now for before, now in pairwise(found) if before[1] != now[1]]
        return TurningPoints(found[0][1], tuple(period for period, _ in turns))

    def _truth_over(self, steps: Sequence[int], early: int, late: int) -> Range:
        """The truth values that the condition has over some periods, as a range."""
        time: Range = early, late
        step_s = self._numbering.exact_period_s
        if not self._counter and step_s is not None:
            # Rounded once, as the float of a fraction is.
            up, down = step_s.numerator, step_s.denominator
            time = early * up / down, late * up / down
        values: dict[int, Range] = {}
        for number in steps:
            operation, parts = self._steps[number]
            of = [values.get(part) or self._constant_ranges[part] for part in parts]
            values[number] = operation(*of) if operation else time
        return values[steps[-1]]

    def _steps_to(self, number: int) -> list[int]:
        """The steps to a value, in the order in which they are taken."""
        needed, open_ = set[int](), [number]
        while open_:
            step = open_.pop()
            if step in self._steps and step not in needed:
                needed.add(step)
                open_ += self._steps[step].parts
        return sorted(needed)

    def _register(self, expr: Expr) -> bool:
        """Whether an expression depends on time and constants alone; its steps are recorded."""
        number = self._numbering.number(expr)
        if (
            number not in self._steps
            and number not in self._constant_ranges
            and number not in self._undetermined
        ):
            value = self._numbering.constant_value(number)
            if isinstance(value, (int, float)):
                self._constant_ranges[number] = value, value
            elif step := self._step(self._numbering.resolve(expr)):
                self._steps[number] = step
            else:
                self._undetermined.add(number)
        return number not in self._undetermined

    def _step(self, expr: Expr) -> _Step | None:
        if self._is_time(expr):
            return _Step(None, ())
        operation, parts = operation_of(expr), tuple(children(expr))
        scalar = kind(expr.type).sort in ("truth", "whole", "real")
        if operation is None or not (scalar and all(map(self._register, parts))):
            return None
        return _Step(operation, tuple(map(self._numbering.number, parts)))

    def _is_time(self, expr: Expr) -> bool:
        if self._counter:
            return isinstance(expr, MemoryRef) and expr.name == self._counter
        return isinstance(expr, Clock) and expr.name == "elapsed"

    def _timing(self, expr: Expr) -> Timing:
        number = self._numbering.number(expr)
        if number not in self._timings:
            self._timings[number] = self._compute_timing(self._numbering.resolve(expr))
        return self._timings[number]

    def _compute_timing(self, expr: Expr) -> Timing:
        if isinstance(expr, Clock):
            return "followed" if expr.name == "elapsed" else ""
        if isinstance(expr, Call):
            return ""  # nothing is known of its result anyway
        timings = {self._timing(part) for part in children(expr)}
        if timings <= {""} or self._is_followed(expr):
            return max(timings, default="")
        return "not followed"

    def _is_followed(self, expr: Expr) -> bool:
        match expr:
            case Binary(op="*" | "/" as op, left=left, right=right):
                return self._is_known(right) or (op == "*" and self._is_known(left))
            case Binary(op=op):
                return op in "+-"
            case Builtin(name=name):
                return FUNCTIONS[name].is_modelled
        return isinstance(expr, (IsOneOf, Choice, Compare, Component, IsNone, Logic, Unary))

    def _is_known(self, expr: Expr) -> bool:
        return self._numbering.constant_value(self._numbering.number(expr)) is not None
