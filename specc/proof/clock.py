"""Comparisons with the time in a state: whole periods, at one of which the answer changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Literal, NamedTuple

from specc.limits import spend
from specc.model.expr import (
    Among,
    Binary,
    Builtin,
    Call,
    Choice,
    Clock,
    Compare,
    Component,
    Expr,
    IsNone,
    Logic,
    Number,
    Unary,
    children,
)
from specc.model.types import Bool, Int, Real
from specc.model.units import SECOND
from specc.proof.numbering import Numbering

# Least and greatest values of floats: rounding keeps order, so that bounds of operands give them.
#
# A truth value is a number here, false before true.


Range = tuple[float, float]
Operation = Callable[..., Range]

ANY: Range = (-math.inf, math.inf)
"""What is not known, or fails in some cases."""


def _spanned(*ends: float) -> Range:
    return ANY if any(map(math.isnan, ends)) else (min(ends), max(ends))


def _product(a: Range, b: Range) -> Range:
    return _spanned(*(x * y for x in a for y in b))


def _quotient(a: Range, b: Range) -> Range:
    return ANY if b[0] <= 0 <= b[1] else _spanned(*(x / y for x in a for y in b))


def _absolute(a: Range) -> Range:
    low, high = a
    return _spanned(abs(low), abs(high)) if low > 0 or high < 0 else (0, max(-low, high))


def _root(a: Range) -> Range:
    return (math.sqrt(a[0]), math.sqrt(a[1])) if a[0] >= 0 else ANY


def _power(a: Range, b: Range) -> Range:
    """Libraries round powers to one of the two floats that are next to them."""
    exponent = b[0]
    if b[0] != b[1] or (a[0] <= 0 and (exponent < 0 or exponent != int(exponent))):
        return ANY
    ends = [_powers(x, exponent) for x in (_absolute(a) if exponent % 2 == 0 else a)]
    return _spanned(*(end for pair in ends for end in pair))


def _powers(base: float, exponent: float) -> Range:
    found = base**exponent
    if not math.isfinite(base) or not math.isfinite(found):
        return found, found
    if exponent == int(exponent) and Fraction(found) == Fraction(base) ** int(exponent):
        return found, found
    return math.nextafter(found, -math.inf), math.nextafter(found, math.inf)


def _less(a: Range, b: Range) -> Range:
    return a[1] < b[0], a[0] < b[1]


def _at_most(a: Range, b: Range) -> Range:
    return a[1] <= b[0], a[0] <= b[1]


def _equal(a: Range, b: Range) -> Range:
    return a[0] == a[1] == b[0] == b[1], a[0] <= b[1] and b[0] <= a[1]


def _not(a: Range) -> Range:
    return not a[1], not a[0]


def _choice(test: Range, then: Range, otherwise: Range) -> Range:
    if test[0] == test[1]:
        return then if test[0] else otherwise
    return _spanned(*then, *otherwise)


def _least(*of: Range) -> Range:
    return min(low for low, _ in of), min(high for _, high in of)


def _greatest(*of: Range) -> Range:
    return max(low for low, _ in of), max(high for _, high in of)


def _difference(a: Range, b: Range) -> Range:
    return _spanned(a[0] - b[1], a[1] - b[0])


OPERATIONS: dict[str, Operation] = {
    "+": lambda a, b: _spanned(a[0] + b[0], a[1] + b[1]),
    "-": lambda a, b=None: (-a[1], -a[0]) if b is None else _difference(a, b),
    "*": _product,
    "/": _quotient,
    "**": _power,
    "abs": _absolute,
    "sqrt": _root,
    "min": _least,
    "max": _greatest,
    "near": lambda a, b, limit: _at_most(_absolute(_difference(a, b)), limit),
    "<": _less,
    "<=": _at_most,
    ">": lambda a, b: _less(b, a),
    ">=": lambda a, b: _at_most(b, a),
    "==": _equal,
    "!=": lambda a, b: _not(_equal(a, b)),
    "not": _not,
    "and": _least,
    "or": _greatest,
    "choice": _choice,
}
"""By the sign or name of what the language computes with numbers and truth values."""


# Conditions about the time in a state: whole periods, at some of which their truth changes.


LONGEST = 2**40
"""Periods that no state lasts; later ones are not asked about."""
MOST_STEPS = 50_000
"""Operations that are computed for one condition."""
_FOLLOWED = ("abs", "min", "max", "near")

ELAPSED = Clock("elapsed", type=Real(SECOND))

Timing = Literal["", "followed", "not followed"]
"""Whether the time in a state is asked for, and whether proofs follow what is computed from it."""


class _Step(NamedTuple):
    """How a value is computed from others; the time in a state has no operation."""

    operation: Operation | None
    parts: tuple[int, ...]


class UndecidedError(Exception):
    """The ranges of values do not tell."""


class Turns(NamedTuple):
    """Whether a condition holds in the first period, and the periods at which that changes."""

    first: bool
    at: tuple[int, ...]


class Timer:
    """Truth of what is computed from `elapsed` and constants alone, as generated code has it.

    It is asked of ranges of periods, which are halved until the values in them tell.
    """

    def __init__(self, numbering: Numbering) -> None:
        self._numbering = numbering
        # All by value number. Parts have smaller numbers than what is computed from them.
        self._known: dict[int, Range] = {}
        self._steps: dict[int, _Step] = {}
        self._others: set[int] = set()
        self._timings: dict[int, Timing] = {}
        self._turns: dict[int, Turns | None] = {}
        for value in numbering.named():
            self._enter(value)
            self._timing(value)

    def turns(self, condition: Expr) -> Turns | None:
        """When a condition holds; None if not time alone tells, or ranges of values do not."""
        number = self._numbering.number(condition)
        self._enter(condition)
        if self._numbering.exact_period_s is None or number not in self._steps:
            return None
        if number not in self._turns:
            try:
                self._turns[number] = self._bisected(self._needed(number))
            except (ArithmeticError, UndecidedError):
                self._turns[number] = None
        return self._turns[number]

    def before(self, period: int) -> Expr:
        """The condition that the state has lasted fewer periods."""
        assert self._numbering.exact_period_s is not None  # there are turns
        time_s = float(period * self._numbering.exact_period_s)
        return Compare("<", ELAPSED, Number(time_s, type=ELAPSED.type), type=Bool())

    def is_unsure(self, condition: Expr) -> bool:
        """Whether what a run computes from the time may not be what proofs make of it."""
        if self._numbering.exact_period_s is None:
            return False
        if self._enter(condition):
            return self._timing(condition) != "" and self.turns(condition) is None
        return self._timing(condition) == "not followed"

    def _bisected(self, steps: Sequence[int]) -> Turns:
        found: list[tuple[int, bool]] = []
        open_, left = [(1, LONGEST)], MOST_STEPS
        while open_:
            early, late = open_.pop()
            left -= len(steps)
            if left < 0 or not spend("proof", len(steps)):
                raise UndecidedError
            least, greatest = self._over(steps, early, late)
            if least == greatest:
                found.append((early, bool(least)))
            elif early == late:
                raise UndecidedError
            else:
                middle = (early + late) // 2
                open_ += [(middle + 1, late), (early, middle)]
        turns = [now for before, now in pairwise(found) if before[1] != now[1]]
        return Turns(found[0][1], tuple(period for period, _ in turns))

    def _over(self, steps: Sequence[int], early: int, late: int) -> Range:
        """Whether the condition holds, over some periods."""
        step_s = self._numbering.exact_period_s
        assert step_s is not None  # `turns` looked
        # Rounded once, as the float of a fraction is.
        up, down = step_s.numerator, step_s.denominator
        time_s = early * up / down, late * up / down
        values: dict[int, Range] = {}
        for number in steps:
            operation, parts = self._steps[number]
            of = [values.get(part) or self._known[part] for part in parts]
            values[number] = operation(*of) if operation else time_s
        return values[steps[-1]]

    def _needed(self, number: int) -> list[int]:
        """The steps to a value, in the order in which they are taken."""
        needed, open_ = set[int](), [number]
        while open_:
            step = open_.pop()
            if step in self._steps and step not in needed:
                needed.add(step)
                open_ += self._steps[step].parts
        return sorted(needed)

    def _enter(self, expr: Expr) -> bool:
        """Whether an expression is computed from time and constants alone, in steps noted here."""
        number = self._numbering.number(expr)
        if number not in self._steps and number not in self._known and number not in self._others:
            value = self._numbering.value(number)
            if isinstance(value, (int, float)):
                self._known[number] = value, value
            elif step := self._step(self._numbering.looked_through(expr)):
                self._steps[number] = step
            else:
                self._others.add(number)
        return number not in self._others

    def _step(self, expr: Expr) -> _Step | None:
        if isinstance(expr, Clock) and expr.name == "elapsed":
            return _Step(None, ())
        operation, parts = OPERATIONS.get(sign_of(expr)), tuple(children(expr))
        numbers = isinstance(expr.type, (Bool, Int, Real)) and all(map(self._enter, parts))
        if operation is None or not numbers:
            return None
        return _Step(operation, tuple(map(self._numbering.number, parts)))

    def _timing(self, expr: Expr) -> Timing:
        number = self._numbering.number(expr)
        if number not in self._timings:
            self._timings[number] = self._found_timing(self._numbering.looked_through(expr))
        return self._timings[number]

    def _found_timing(self, expr: Expr) -> Timing:
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
                return name in _FOLLOWED
        return isinstance(expr, (Among, Choice, Compare, Component, IsNone, Logic, Unary))

    def _is_known(self, expr: Expr) -> bool:
        return self._numbering.value(self._numbering.number(expr)) is not None


def sign_of(expr: Expr) -> str:
    """What an operation is called in `OPERATIONS`."""
    match expr:
        case Unary(op=sign) | Binary(op=sign) | Compare(op=sign) | Logic(op=sign):
            return sign
        case Builtin(name=sign):
            return sign
    return "choice" if isinstance(expr, Choice) else ""
