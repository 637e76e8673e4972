"""The functions of the language: all that is known of each stands in one table.

A new one needs a row here, a line in `docs/language.md` and, unless Python has it, an
implementation in `specc_runtime.builtins`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from functools import partial

from specc.lang import encodings, inverses, ranges, results, values
from specc.lang import functions as rules
from specc.lang.errors import CLOCK_NAMES
from specc.lang.row import BuiltinFunction, Encoding, Form
from specc.model import expr as m
from specc.model.expr import Fresh, Present
from specc.model.types import Int, Pose, Real, Type, Vector
from specc.model.units import METRE, RADIAN, SECOND

# The table.


_SUM = Form("{:sum} + {:product}", "sum")
_REST = Form("{:primary}[{}:]", "primary")
_CLOSE = Form("abs({:sum} - {:product}) <= {:sum}", "compare")


def _near_form(type: Type) -> Form | str:
    if isinstance(type, Pose):
        return "near_pose"
    return "" if type.is_array else _CLOSE


_exact = partial(BuiltinFunction, rounds=False, may_fail=False, overflows=False)


def _of_angle(name: str, value: Callable[[float], float]) -> BuiltinFunction:
    return BuiltinFunction(
        f"angle -> real: the {'sine' if name == 'sin' else 'cosine'} of an angle",
        rules.of_one(
            f"{name}(angle)", "takes an angle, `real[rad]`", results.ratio, results.no_angle
        ),
        gives_way=True,
        value=value,
        python="math",
        may_fail=False,
        overflows=False,
        shows=True,
        within=(-1.0, 1.0),
    )


def _to_int(name: str, says: str, value: Callable[[float], int], term: Encoding) -> BuiltinFunction:
    return _exact(
        f"a -> int: {says}",
        rules.of_one(f"{name}(a)", "takes a number without unit", results.whole, results.with_unit),
        gives_way=True,
        value=value,
        python=value.__module__.removeprefix("builtins"),
        folds=True,
        range=ranges.rising(value),
        term=term,
        stays_float=True,
        inverse=inverses.of_whole,
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
        within=ranges.NOT_NEGATIVE,
        gives_way=True,
    ),
    "late": _exact(
        "x.peer.element -> int: periods that its sender has skipped in a row until now",
        rules.lag("late", Int()),
        python="",
        within=ranges.NOT_NEGATIVE,
        gives_way=True,
    ),
    m.NEAR: _exact(
        "a, b, tolerance, angle -> bool: numbers or vectors within a tolerance; two poses within a "
        "distance and an angle",
        rules.near,
        value=values.near,
        form=_near_form,
        compares=True,
        range=ranges.near,
        inverse=inverses.of_near,
        alike="`{}` is compared with itself",
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
        rules.of_one("inverse(X)", "takes a pose", results.turned, wanted=results.turned),
        value=values.inverse,
        may_fail=False,
        shows=True,
        inverse=inverses.of_inverse,
    ),
    "position": _exact(
        "X -> point[A]: the origin of B in A, of a pose[A, B]",
        rules.position,
        value=values.position,
        shows=True,
        range=ranges.unchanged,
        inverse=inverses.of_position,
    ),
    m.IDENTITY: _exact(
        "-> pose: between the frames that the place requires",
        rules.making_pose("identity()"),
        value=lambda: values.translation(0.0, 0.0, 0.0),
    ),
    m.TRANSLATION: _exact(
        "x, y, z -> pose: between the frames that the place requires",
        rules.making_pose("translation(x, y, z)", *[Real(METRE)] * 3),
        value=values.translation,
        shows=True,
        range=ranges.union,
        inverse=inverses.of_translation,
    ),
    m.POSE: BuiltinFunction(
        "p, q -> pose: q is a quaternion (x, y, z, w)",
        rules.making_pose(
            "pose(position, quaternion_xyzw)", Vector(3, Real(METRE)), Vector(4, Real())
        ),
        value=values.pose,
        constants_checked=True,
        overflows=False,
        direction=1,
    ),
    m.LENGTH: _exact(
        "list -> int: number of items",
        rules.of_one("len(list)", "counts the items of a list", results.length, results.always),
        value=len,
        python="",
        within=ranges.NOT_NEGATIVE,
        inverse=inverses.of_len,
    ),
    "norm": BuiltinFunction(
        "v -> real: length of a vector, in its unit",
        rules.of_one("norm(vector)", "takes a vector of reals", results.real_element),
        value=lambda v: math.hypot(*v),
        may_fail=False,
        shows=True,
        within=ranges.NOT_NEGATIVE,
        inverse=inverses.of_norm,
        is_costly=True,
    ),
    "abs": _exact(
        "a -> number",
        rules.of_one(
            "abs(a)",
            "takes a number",
            results.number,
            lambda type: "the length of a vector is `norm(v)`",
        ),
        value=abs,
        python="",
        within=ranges.NOT_NEGATIVE,
        range=ranges.absolute,
        is_size=True,
        term=lambda of, a: of.choice(a > -a, a, -a),
        inverse=inverses.of_abs,
    ),
    "min": _exact(
        "a, b, ... -> number: numbers of one unit",
        rules.of_numbers("a, b", 2, None),
        value=min,
        python="",
        range=ranges.least,
        chooses=True,
        picks=-1,
        term=encodings.least,
        inverse=inverses.any_argument,
        alike="`{}` stands twice in `min`",
    ),
    "max": _exact(
        "a, b, ... -> number: numbers of one unit",
        rules.of_numbers("a, b", 2, None),
        value=max,
        python="",
        range=ranges.greatest,
        chooses=True,
        picks=1,
        term=encodings.greatest,
        inverse=inverses.any_argument,
        alike="`{}` stands twice in `max`",
    ),
    "clamp": _exact(
        "a, low, high -> number: what is nearest to a from low to high; numbers of one unit",
        rules.of_numbers("a, low, high", 3, 3),
        gives_way=True,
        value=lambda a, low, high: min(max(a, low), high),
        python="",
        form=lambda type: Form("min(max({}, {}), {})", "primary"),
        range=lambda a, low, high: ranges.least(ranges.greatest(a, low), high),
        chooses=True,
        limits=(1, 2),
        term=encodings.clamped,
        inverse=inverses.any_argument,
        folds=True,
        alike="`{}` stands twice in `clamp`",
    ),
    "hypot": BuiltinFunction(
        "a, b -> real: length of the diagonal of a rectangle, in the unit of its sides",
        rules.of_numbers("a, b", 2, 2, is_real=True),
        gives_way=True,
        value=math.hypot,
        python="math",
        may_fail=False,
        shows=True,
        within=ranges.NOT_NEGATIVE,
        range=ranges.diagonal,
        laws=encodings.diagonal,
        inverse=inverses.of_hypot,
    ),
    "sign": _exact(
        "a -> int: -1, 0 or 1",
        rules.of_one("sign(a)", "takes a number", results.of_sign),
        gives_way=True,
        value=values.sign,
        within=(-1, 1),
        range=ranges.signs,
        term=encodings.sign,
        stays_float=True,
        inverse=inverses.of_sign,
        folds=True,
    ),
    "floor": _to_int(
        "floor", "the greatest whole number that is not greater", math.floor, encodings.floor
    ),
    "round": _to_int(
        "round", "the nearest whole number; the even one of two", round, encodings.rounded
    ),
    "wrap_angle": _exact(
        "angle -> real[rad]: the same direction from -pi to just below pi",
        rules.of_one(
            "wrap_angle(angle)", "takes an angle, `real[rad]`", results.angle, results.no_angle
        ),
        gives_way=True,
        value=values.wrap_angle,
        within=ranges.DIRECTIONS,
        range=ranges.wrapped,
        term=encodings.wrapped,
        inverse=inverses.of_wrap_angle,
        folds=True,
    ),
    "sqrt": BuiltinFunction(
        "a -> real: half the powers of the unit",
        rules.of_one("sqrt(a)", "takes a number", results.root, wanted=lambda hint: Real()),
        value=math.sqrt,
        python="math",
        overflows=False,
        shows=True,
        folds=True,
        within=ranges.NOT_NEGATIVE,
        range=ranges.root,
        inverse=inverses.of_sqrt,
    ),
    "sin": _of_angle("sin", math.sin),
    "cos": _of_angle("cos", math.cos),
    "atan2": BuiltinFunction(
        "y, x -> real[rad]: the angle from the first axis to the point (x, y), from -pi to pi",
        rules.of_numbers("y, x", 2, 2, result=Real(RADIAN)),
        value=math.atan2,
        python="math",
        within=ranges.HALF_TURNS,
        alike="both coordinates of this angle are `{}`",
        may_fail=False,
        overflows=False,
        gives_way=True,
    ),
    m.JOINED: _exact(
        "list, list -> list: the items of both",
        None,
        value=operator.add,
        python="",
        form=lambda type: _SUM,
    ),
    m.REST: _exact(
        "list, n -> list: all items but the first n",
        None,
        value=lambda items, first: items[first:],
        python="",
        form=lambda type: _REST,
        neutral=(1, 0),
    ),
    m.FLOAT: BuiltinFunction(
        "n -> real: what an integer in the place of a real becomes",
        None,
        value=float,
        python="",
        rounds=False,
        overflows=False,
        range=ranges.rising(float),
        term=lambda of, a: a,
        inverse=inverses.of_float,
    ),
    m.FINITE: BuiltinFunction(
        "a -> real: the result of arithmetic, which has been looked at",
        None,
        rounds=False,
        overflows=False,
        range=ranges.unchanged,
    ),
}

BUILTIN_NAMES = tuple(sorted(name for name, function in FUNCTIONS.items() if function.rule))
_LATER = {name for name, function in FUNCTIONS.items() if function.gives_way}
RESERVED = frozenset({"True", "False", "x", "y", "_", *CLOCK_NAMES, *BUILTIN_NAMES}) - _LATER
"""Names of the language; a specification gives them to nothing of its own."""
