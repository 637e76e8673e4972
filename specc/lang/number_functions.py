"""The functions of numbers: what each computes, and all that proofs know of it.

What a row names stands above it: ranges, terms of the solver, arguments for a wanted result.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from functools import reduce
from operator import gt, lt
from typing import Any

from specc.lang import functions as rules
from specc.lang import ranges
from specc.lang.context import scalar_unit
from specc.lang.functions import (
    ArgumentChoices,
    BuiltinFunction,
    Encoding,
    Form,
    SolverTerms,
    exact,
)
from specc.lang.ranges import ANY, Operation, Range
from specc.lang.values import Value
from specc.model import expr as m
from specc.model.types import Int, Real, Type
from specc.model.units import RADIAN

# What Python has no function for.


def sign(a: float) -> int:
    """-1, 0 or 1."""
    return (a > 0) - (a < 0)


def wrap_angle(angle_rad: float) -> float:
    """The angle of the same direction in [-pi, pi), radians, where a full turn is the float 2 pi.

    The remainder is exact, and pi itself, which it may give, is -pi here. Zero has no sign.
    """
    rest = math.remainder(angle_rad, math.tau)
    return rest + 0.0 if rest < math.pi else -math.pi


# Ranges of results, by those of arguments.


def _diagonal(a: Range, b: Range) -> Range:
    """The range of `hypot(a, b)`, which libraries round to one of the two floats next to it."""
    (low_a, high_a), (low_b, high_b) = ranges.absolute(a), ranges.absolute(b)
    least = max(low_a, low_b, math.nextafter(math.hypot(low_a, low_b), 0.0))
    return least, math.nextafter(math.hypot(high_a, high_b), math.inf)


def _wrap_angle_range(a: Range) -> Range:
    """The range of `wrap_angle(a)`, which increases except where it wraps."""
    if any(map(math.isinf, a)):
        return ranges.DIRECTIONS
    turns = [(Fraction(end) + Fraction(math.pi)) // Fraction(math.tau) for end in a]
    return (wrap_angle(a[0]), wrap_angle(a[1])) if turns[0] == turns[1] else ranges.DIRECTIONS


def _increasing(value: Callable[[float], float]) -> Operation:
    """The range of an increasing function of one number, which is not asked of infinity."""

    def ends(a: Range) -> Range:
        low, high = (end if math.isinf(end) else value(end) for end in a)
        return low, high

    return ends


# What the solver has: terms, or laws of a result that is unknown.


def _choice_term(is_first: Callable[[Any, Any], Any]) -> Encoding:
    """The term of `min(a, b, ...)` or `max(a, b, ...)`."""

    def term(of: SolverTerms, *args: Any) -> Any:
        return reduce(lambda a, b: of.choice(is_first(a, b), a, b), args)

    return term


_least_term, _greatest_term = _choice_term(lt), _choice_term(gt)


def _round_term(of: SolverTerms, a: Any) -> Any:
    """The term of `round(a)`."""
    above = a + of.constant(0.5)
    whole = of.floor(above)
    return of.choice(whole == above, whole - whole % 2, whole)  # a tie goes to what is even


def _wrapped_term(of: SolverTerms, a: Any) -> Any:
    """The term of `wrap_angle(a)`, of which both the argument and the result are floats."""
    turn = of.constant(math.tau)
    return of.representable(a - turn * of.floor((a + of.constant(math.pi)) / turn))


def _diagonal_laws(of: SolverTerms, result: Any, *args: Any) -> Iterator[Any]:
    """`hypot(a, b)`: not less than either, nor more than both; libraries err by less than an ulp.

    What is too large is a number that is larger than all others.
    """
    a, b = (of.choice(arg > -arg, arg, -arg) for arg in args)
    yield result >= a
    yield result >= b
    most = (a + b) * of.constant(1 + Fraction(1, 2**52)) + of.constant(Fraction(1, 2**1074))
    yield of.choice(most < of.constant(sys.float_info.max), result <= most, result >= a)


# Which argument has to have which value so that the result is the one that is wanted.


def _from_any(types: Sequence[Type], now: Sequence[Value], value: Value) -> ArgumentChoices:
    """Yield this value for each argument in turn, of a function that chooses one of them."""
    for index in range(len(now)):
        yield index, value


def _from_hypot(types: Sequence[Type], now: Sequence[Value], value: Value) -> ArgumentChoices:
    """Yield arguments of `hypot(a, b)`: one by the other, or all of it along the first axis."""
    for index, other in ((0, now[1]), (1, now[0])):
        if value >= abs(other):
            yield index, math.sqrt(value - other) * math.sqrt(value + other)
    if value >= 0:
        yield 0, value


def _from_whole(types: Sequence[Type], now: Sequence[Value], value: Value) -> ArgumentChoices:
    """Yield the argument of `floor(a)`, `round(a)` or `float(a)` that has this value."""
    yield 0, _typed(types[0], value)


def _typed(type_: Type, number: float) -> float:
    return int(number) if isinstance(type_, Int) else float(number)


# The rows.


def _of_angle(name: str, value: Callable[[float], float]) -> BuiltinFunction:
    return BuiltinFunction(
        f"angle -> real: the {'sine' if name == 'sin' else 'cosine'} of an angle",
        rules.unary_rule(
            f"{name}(angle)",
            "takes an angle, `real[rad]`",
            lambda type: Real() if type == Real(RADIAN) else None,
            rules.angle_help,
        ),
        is_overridable=True,
        value=value,
        python="math",
        may_fail=False,
        overflows=False,
        propagates=True,
        bounds=(-1.0, 1.0),
    )


def _to_int(name: str, says: str, value: Callable[[float], int], term: Encoding) -> BuiltinFunction:
    return exact(
        f"a -> int: {says}",
        rules.unary_rule(
            f"{name}(a)", "takes a number without unit", rules.integer_type, rules.unit_help
        ),
        is_overridable=True,
        value=value,
        python=value.__module__.removeprefix("builtins"),
        is_foldable=True,
        range=_increasing(value),
        term=term,
        stays_float=True,
        inverse=_from_whole,
    )


NUMBER_FUNCTIONS: dict[str, BuiltinFunction] = {
    "abs": exact(
        "a -> number",
        rules.unary_rule(
            "abs(a)",
            "takes a number",
            lambda type: None if scalar_unit(type) is None else type,
            lambda type: "the length of a vector is `norm(v)`",
        ),
        value=abs,
        python="",
        notation="bars",
        bounds=ranges.NOT_NEGATIVE,
        range=ranges.absolute,
        is_size=True,
        is_foldable=True,
        term=lambda of, a: of.choice(a > -a, a, -a),
        inverse=lambda types, now, value: iter([(0, value), (0, -value)] if value >= 0 else []),
    ),
    "min": exact(
        "a, b, ... -> number: numbers of one unit",
        rules.numbers_rule("a, b", 2, None),
        value=min,
        python="",
        range=ranges.least,
        chooses=True,
        picks=-1,
        is_foldable=True,
        term=_least_term,
        inverse=_from_any,
        same_arguments="`{}` stands twice in `min`",
    ),
    "max": exact(
        "a, b, ... -> number: numbers of one unit",
        rules.numbers_rule("a, b", 2, None),
        value=max,
        python="",
        range=ranges.greatest,
        chooses=True,
        picks=1,
        is_foldable=True,
        term=_greatest_term,
        inverse=_from_any,
        same_arguments="`{}` stands twice in `max`",
    ),
    "clamp": exact(
        "a, low, high -> number: what is nearest to a from low to high; numbers of one unit",
        rules.numbers_rule("a, low, high", 3, 3),
        is_overridable=True,
        value=lambda a, low, high: min(max(a, low), high),
        python="",
        form=lambda type: Form("min(max({}, {}), {})", "primary"),
        range=lambda a, low, high: ranges.least(ranges.greatest(a, low), high),
        chooses=True,
        limits=(1, 2),
        term=lambda of, a, low, high: _least_term(of, _greatest_term(of, a, low), high),
        inverse=_from_any,
        is_foldable=True,
        same_arguments="`{}` stands twice in `clamp`",
    ),
    "hypot": BuiltinFunction(
        "a, b -> real: length of the diagonal of a rectangle, in the unit of its sides",
        rules.numbers_rule("a, b", 2, 2, is_real=True),
        is_overridable=True,
        value=math.hypot,
        python="math",
        may_fail=False,
        propagates=True,
        bounds=ranges.NOT_NEGATIVE,
        range=_diagonal,
        laws=_diagonal_laws,
        inverse=_from_hypot,
    ),
    "sign": exact(
        "a -> int: -1, 0 or 1",
        rules.unary_rule(
            "sign(a)", "takes a number", lambda type: None if scalar_unit(type) is None else Int()
        ),
        is_overridable=True,
        value=sign,
        bounds=(-1, 1),
        turns_at=(0,),
        range=lambda a: (sign(a[0]), sign(a[1])),
        term=lambda of, a: of.choice(
            a > 0, of.whole(1), of.choice(a < 0, of.whole(-1), of.whole(0))
        ),
        stays_float=True,
        inverse=lambda types, now, value: iter(
            [(0, _typed(types[0], value * max(1, abs(now[0]))))]
        ),
        is_foldable=True,
    ),
    "floor": _to_int(
        "floor",
        "the greatest whole number that is not greater",
        math.floor,
        lambda of, a: of.floor(a),
    ),
    "round": _to_int("round", "the nearest whole number; the even one of two", round, _round_term),
    "wrap_angle": exact(
        "angle -> real[rad]: the same direction from -pi to just below pi",
        rules.unary_rule(
            "wrap_angle(angle)",
            "takes an angle, `real[rad]`",
            lambda type: type if type == Real(RADIAN) else None,
            rules.angle_help,
        ),
        is_overridable=True,
        value=wrap_angle,
        bounds=ranges.DIRECTIONS,
        range=_wrap_angle_range,
        term=_wrapped_term,
        inverse=lambda types, now, value: iter([(0, value)] if -math.pi <= value < math.pi else []),
        is_foldable=True,
    ),
    "sqrt": BuiltinFunction(
        "a -> real: half the powers of the unit",
        rules.unary_rule(
            "sqrt(a)",
            "takes a number",
            lambda type: (
                None if (unit := scalar_unit(type)) is None else Real(unit ** Fraction(1, 2))
            ),
            wanted=lambda hint: Real(),
        ),
        value=math.sqrt,
        python="math",
        notation="root",
        overflows=False,
        propagates=True,
        is_foldable=True,
        bounds=ranges.NOT_NEGATIVE,
        range=lambda a: (math.sqrt(a[0]), math.sqrt(a[1])) if a[0] >= 0 else ANY,
        inverse=lambda types, now, value: iter([(0, value * value)] if value >= 0 else []),
    ),
    "sin": _of_angle("sin", math.sin),
    "cos": _of_angle("cos", math.cos),
    "atan2": BuiltinFunction(
        "y, x -> real[rad]: the angle from the first axis to the point (x, y), from -pi to pi",
        rules.numbers_rule("y, x", 2, 2, result=Real(RADIAN)),
        value=math.atan2,
        python="math",
        bounds=ranges.HALF_TURNS,
        same_arguments="both coordinates of this angle are `{}`",
        may_fail=False,
        overflows=False,
        is_overridable=True,
    ),
    m.FLOAT: BuiltinFunction(
        "n -> real: what an integer in the place of a real becomes",
        None,
        value=float,
        python="",
        rounds=False,
        overflows=False,
        range=_increasing(float),
        term=lambda of, a: a,
        inverse=_from_whole,
    ),
    m.FINITE: BuiltinFunction(
        "a -> real: the result of arithmetic, which has been looked at",
        None,
        rounds=False,
        overflows=False,
        range=ranges.identity,
    ),
}
