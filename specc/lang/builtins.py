"""The functions of the language: all that is known of each stands in one table.

A new one needs a row here, a line in `docs/language.md` and, unless Python has it, an
implementation in `specc_runtime.builtins`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from fractions import Fraction
from functools import partial
from typing import Any

from specc.frozen import frozen
from specc.lang import functions as rules
from specc.lang import values
from specc.lang.errors import CLOCK_NAMES
from specc.lang.mismatch import scalar_unit
from specc.model.expr import Fresh, Present
from specc.model.types import Int, ListOf, Pose, Real, Type, Vector
from specc.model.units import DIMENSIONLESS, METRE, RADIAN, SECOND

# Types of results by the type of the argument; None for an argument that does not fit.


def _turned(type: Type | None) -> Type | None:
    return Pose(type.child, type.parent) if isinstance(type, Pose) else None


def _real_element(type: Type) -> Real | None:
    return type.element if isinstance(type, Vector) and isinstance(type.element, Real) else None


def _root(type: Type) -> Type | None:
    unit = scalar_unit(type)
    return None if unit is None else Real(unit ** Fraction(1, 2))


def _length(type: Type) -> Type | None:
    return Int() if isinstance(type, ListOf) else None


def _ratio(type: Type) -> Type | None:
    return Real() if type == Real(RADIAN) else None


def _number(type: Type) -> Type | None:
    return None if scalar_unit(type) is None else type


def _no_angle(type: Type) -> str:
    plain = scalar_unit(type) == DIMENSIONLESS
    return "an angle has a unit: `30[deg]`; multiply a plain number by `1[rad]`" if plain else ""


def _always(type: Type) -> str:
    return f"its length is always {type.size}" if isinstance(type, Vector) else ""


# The table.


RUNTIME = "specc_runtime.builtins"


@frozen
class BuiltinFunction:
    """A function of the language. What is said of a result holds of each of its components.

    The defaults are what is safe to believe of a function that nobody has thought about.
    """

    says: str
    """Parameters, result and what it is, for editors: `X -> pose: pose[B, A] of a pose[A, B]`."""
    rule: rules.Rule | None
    """Types a call; None for a function that only the compiler calls."""
    value: Callable[..., Any] = NotImplemented
    """What it computes on plain Python values, with integers as floats if the result is a real."""
    python: str = RUNTIME
    """The module that has it for generated code; "" for a function of Python's own."""
    rounds: bool = True
    """Whether its result may differ from that of exact numbers."""
    may_fail: bool = True
    """Whether it raises for some arguments, so that it is called only where it is needed."""
    overflows: bool = True
    """Whether finite arguments may give a result that is not finite."""
    shows: bool = False
    """Whether an argument that is not finite gives a result that is not finite, or an error."""
    no_larger: bool = False
    """Whether its result is never larger than its largest argument, up to sign."""
    not_negative: bool = False
    """Whether its result is a number that is never negative."""
    is_costly: bool = False
    """Whether calling it again costs more than keeping its result; arrays always do."""
    sign: str = ""
    """How the compiler's own is written, with braces for the arguments: `{} + {}`."""
    gives_way: bool = False
    """Whether an operator of that name takes its place; version 1 did not have it."""


_exact = partial(BuiltinFunction, rounds=False, may_fail=False, overflows=False)


def _of_angle(name: str, value: Callable[[float], float]) -> BuiltinFunction:
    return BuiltinFunction(
        f"angle -> real: the {'sine' if name == 'sin' else 'cosine'} of an angle",
        rules.of_one(f"{name}(angle)", "takes an angle, `real[rad]`", _ratio, _no_angle),
        value,
        python="math",
        may_fail=False,
        overflows=False,
        shows=True,
        gives_way=True,
    )


FUNCTIONS: dict[str, BuiltinFunction] = {
    "fresh": _exact(
        "x.peer.element -> bool: a value became visible since the previous period",
        rules.of_input("fresh(x.peer.element)", Fresh),
        python="",
    ),
    "present": _exact(
        "x.peer.element -> bool: the element has received a value at least once",
        rules.of_input("present(x.peer.element)", Present),
        python="",
    ),
    "age": _exact(
        "x.peer.element -> real[s]: the time since the oldest measurement behind the value",
        rules.lag("age", Real(SECOND)),
        python="",
        not_negative=True,
        gives_way=True,
    ),
    "late": _exact(
        "x.peer.element -> int: periods that its sender has skipped in a row until now",
        rules.lag("late", Int()),
        python="",
        not_negative=True,
        gives_way=True,
    ),
    "near": _exact(
        "a, b, tolerance, angle -> bool: numbers or vectors within a tolerance; two poses within a "
        "distance and an angle",
        rules.near,
        values.near,
    ),
    "all": _exact(
        "test for v in list -> bool: for every item of a list or component of a vector",
        rules.quantifier("all"),
        python="",
    ),
    "any": _exact(
        "test for v in list -> bool: for some item of a list or component of a vector",
        rules.quantifier("any"),
        python="",
    ),
    "argmax": _exact(
        "number for v in list -> item: the item for which the number is largest",
        rules.extreme("argmax"),
    ),
    "argmin": _exact(
        "number for v in list -> item: the item for which the number is smallest",
        rules.extreme("argmin"),
    ),
    "inverse": BuiltinFunction(
        "X -> pose: pose[B, A] of a pose[A, B]",
        rules.of_one("inverse(X)", "takes a pose", _turned, wanted=_turned),
        values.inverse,
        may_fail=False,
        shows=True,
    ),
    "position": _exact(
        "X -> point[A]: the origin of B in A, of a pose[A, B]",
        rules.position,
        values.position,
        shows=True,
        no_larger=True,
    ),
    "identity": _exact(
        "-> pose: between the frames that the place requires",
        rules.making_pose("identity()"),
        lambda: values.translation(0.0, 0.0, 0.0),
    ),
    "translation": _exact(
        "x, y, z -> pose: between the frames that the place requires",
        rules.making_pose("translation(x, y, z)", *[Real(METRE)] * 3),
        values.translation,
        shows=True,
        no_larger=True,
    ),
    "pose": BuiltinFunction(
        "p, q -> pose: q is a quaternion (x, y, z, w)",
        rules.making_pose(
            "pose(position, quaternion_xyzw)", Vector(3, Real(METRE)), Vector(4, Real())
        ),
        values.pose,
        overflows=False,
    ),
    "len": _exact(
        "list -> int: number of items",
        rules.of_one("len(list)", "counts the items of a list", _length, _always),
        len,
        python="",
    ),
    "norm": BuiltinFunction(
        "v -> real: length of a vector, in its unit",
        rules.of_one("norm(vector)", "takes a vector of reals", _real_element),
        lambda v: math.hypot(*v),
        may_fail=False,
        shows=True,
        not_negative=True,
        is_costly=True,
    ),
    "abs": _exact(
        "a -> number",
        rules.of_one(
            "abs(a)", "takes a number", _number, lambda type: "the length of a vector is `norm(v)`"
        ),
        abs,
        python="",
        no_larger=True,
        not_negative=True,
    ),
    "min": _exact(
        "a, b, ... -> number: numbers of one unit",
        rules.of_numbers("a, b", 2, None),
        min,
        python="",
        no_larger=True,
    ),
    "max": _exact(
        "a, b, ... -> number: numbers of one unit",
        rules.of_numbers("a, b", 2, None),
        max,
        python="",
        no_larger=True,
    ),
    "sqrt": BuiltinFunction(
        "a -> real: half the powers of the unit",
        rules.of_one("sqrt(a)", "takes a number", _root, wanted=lambda hint: Real()),
        math.sqrt,
        python="math",
        overflows=False,
        shows=True,
        not_negative=True,
    ),
    "sin": _of_angle("sin", math.sin),
    "cos": _of_angle("cos", math.cos),
    "atan2": BuiltinFunction(
        "y, x -> real[rad]: the angle from the first axis to the point (x, y), from -pi to pi",
        rules.of_numbers("y, x", 2, 2, result=Real(RADIAN)),
        math.atan2,
        python="math",
        may_fail=False,
        overflows=False,
        gives_way=True,
    ),
    "joined": _exact(
        "list, list -> list: the items of both", None, operator.add, python="", sign="{} + {}"
    ),
    "rest": _exact(
        "list, n -> list: all items but the first n",
        None,
        lambda items, first: items[first:],
        python="",
        sign="{}[{}:]",
    ),
    "float": BuiltinFunction(
        "n -> real: what an integer in the place of a real becomes",
        None,
        float,
        python="",
        rounds=False,
        overflows=False,
        no_larger=True,
    ),
    "finite": BuiltinFunction(
        "a -> real: the result of arithmetic, which has been looked at",
        None,
        rounds=False,
        overflows=False,
        no_larger=True,
    ),
}

BUILTIN_NAMES = tuple(sorted(name for name, function in FUNCTIONS.items() if function.rule))
_LATER = {name for name, function in FUNCTIONS.items() if function.gives_way}
RESERVED = frozenset({"True", "False", "x", "y", "_", *CLOCK_NAMES, *BUILTIN_NAMES}) - _LATER
"""Names of the language; a specification gives them to nothing of its own."""
