"""The functions of the language: all that is known of each stands in one table.

A new one needs a row here, or in `specc.lang.number_functions`, a line in `docs/language.md` and,
unless Python has it, an implementation in `specc_runtime.builtins`.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator, Sequence

from specc.lang import functions as rules
from specc.lang import ranges, values
from specc.lang.errors import CLOCK_NAMES
from specc.lang.functions import ArgumentChoices, BuiltinFunction, Form, exact
from specc.lang.kinds import first_value
from specc.lang.number_functions import NUMBER_FUNCTIONS
from specc.lang.values import Value
from specc.model import expr as m
from specc.model.expr import Fresh, Present
from specc.model.types import Int, ListOf, Pose, Real, Type, Vector
from specc.model.units import METRE, RADIAN, SECOND

_SUM = Form("{:sum} + {:product}", "sum")
_REST = Form("{:primary}[{}:]", "primary")
_CLOSE = Form("abs({:sum} - {:product}) <= {:sum}", "compare")


def _near_form(type: Type) -> Form | str:
    if isinstance(type, Pose):
        return "near_pose"
    return "" if type.is_array else _CLOSE


# Which argument has to have which value so that the result is the one that is wanted.


def _from_position(types: Sequence[Type], now: Sequence[Value], value: Value) -> ArgumentChoices:
    """Yield an argument of `position(X)` that gives this value."""
    rows = ((*row[:3], p) for row, p in zip(now[0], value, strict=False))
    yield 0, (*rows, (0.0, 0.0, 0.0, 1.0))


def _from_translation(types: Sequence[Type], now: Sequence[Value], value: Value) -> ArgumentChoices:
    """`translation(x, y, z)`."""
    for index, (old, new) in enumerate(zip(now, values.position(value), strict=True)):
        if old != new:
            yield index, new


def _from_len(types: Sequence[Type], now: Sequence[Value], value: Value) -> ArgumentChoices:
    """Yield the list cut or extended to this length; vectors have the length of their type."""
    of, items = types[0], now[0]
    if isinstance(of, ListOf) and value >= 0:
        more = (first_value(of.element),) * max(0, int(value) - len(items))
        yield 0, (*items, *more)[: int(value)]


def _from_norm(types: Sequence[Type], now: Sequence[Value], value: Value) -> ArgumentChoices:
    """Yield vectors of this norm along one axis."""
    for index in range(len(now[0]) if value >= 0 else 0):
        yield 0, tuple(float(value) * (i == index) for i in range(len(now[0])))


def _from_near(types: Sequence[Type], now: Sequence[Value], wanted: Value) -> ArgumentChoices:
    """Yield arguments for which `near` gives the wanted answer."""
    a, b, tolerance, *_ = now
    for side, other in ((0, b), (1, a)):
        for value in _distant(other, types[side], tolerance, wanted):
            yield side, value
    if not isinstance(types[0], Pose):
        gap = abs(a - b) if not isinstance(a, tuple) else math.dist(a, b)
        yield 2, gap + 1.0 if wanted else gap / 2


def _distant(other: Value, side: Type, tolerance: float, wanted: bool) -> Iterator[Value]:
    """Yield values that are near another one, or not, as wanted."""
    if wanted:
        yield other
    steps = (0.5, -0.5) if wanted else (2.0, -2.0, 1000.0)
    for step in (tolerance * n + (0 if wanted else n) for n in steps):
        if isinstance(side, Pose):
            yield values.compose(other, values.translation(step, 0.0, 0.0))
        elif isinstance(other, tuple):
            yield (other[0] + step, *other[1:])
        else:
            yield other + step


# The table.


_AT_ORIGIN = (0.0, 0.0)
"""The coordinates of the position of a pose that only turns."""

FUNCTIONS: dict[str, BuiltinFunction] = {
    "fresh": exact(
        "x.peer.element -> bool: a value became visible since the previous period",
        rules.input_rule("fresh(x.peer.element)", Fresh),
        python="",
    ),
    "present": exact(
        "x.peer.element -> bool: the element has received a value at least once",
        rules.input_rule("present(x.peer.element)", Present),
        python="",
    ),
    "elapsed": exact(
        "mode -> real[s]: how long the mode has been active since it was entered anew",
        rules.mode_rule("elapsed"),
        python="",
    ),
    "entered": exact(
        "mode -> bool: whether this is the first period after the mode was entered anew",
        rules.mode_rule("entered"),
        python="",
    ),
    "age": exact(
        "x.peer.element -> real[s]: the time since the oldest measurement behind the value",
        rules.lag_rule("age", Real(SECOND)),
        python="",
        bounds=ranges.NOT_NEGATIVE,
        is_overridable=True,
    ),
    "late": exact(
        "x.peer.element -> int: periods that its sender has skipped in a row until now",
        rules.lag_rule("late", Int()),
        python="",
        bounds=ranges.NOT_NEGATIVE,
        is_overridable=True,
    ),
    m.NEAR: exact(
        "a, b, tolerance, angle -> bool: numbers or vectors within a tolerance; two poses within a "
        "distance and an angle",
        rules.near,
        value=values.near,
        form=_near_form,
        compares=True,
        range=ranges.near,
        inverse=_from_near,
        same_arguments="`{}` is compared with itself",
    ),
    "all": exact(
        "test for v in list -> bool: for every item of a list or component of a vector",
        rules.quantifier_rule("all"),
        python="",
    ),
    "any": exact(
        "test for v in list -> bool: for some item of a list or component of a vector",
        rules.quantifier_rule("any"),
        python="",
    ),
    "argmax": exact(
        "number for v in list -> item: the item for which the number is largest",
        rules.extreme_rule("argmax"),
    ),
    "argmin": exact(
        "number for v in list -> item: the item for which the number is smallest",
        rules.extreme_rule("argmin"),
    ),
    m.INVERSE: BuiltinFunction(
        "X -> pose: pose[B, A] of a pose[A, B]",
        rules.unary_rule(
            "inverse(X)", "takes a pose", rules.inverted_pose, wanted=rules.inverted_pose
        ),
        value=values.inverse,
        notation="power -1",
        may_fail=False,
        propagates=True,
        inverse=lambda types, now, value: iter([(0, values.inverse(value))]),
    ),
    "position": exact(
        "X -> point[A]: the origin of B in A, of a pose[A, B]",
        rules.position,
        value=values.position,
        propagates=True,
        range=ranges.identity,
        inverse=_from_position,
    ),
    m.IDENTITY: exact(
        "-> pose: between the frames that the place requires",
        rules.pose_rule("identity()"),
        value=lambda: values.translation(0.0, 0.0, 0.0),
    ),
    m.TRANSLATION: exact(
        "x, y, z -> pose: between the frames that the place requires",
        rules.pose_rule("translation(x, y, z)", *[Real(METRE)] * 3),
        value=values.translation,
        propagates=True,
        range=ranges.union,
        inverse=_from_translation,
    ),
    m.ROTATION: BuiltinFunction(
        "axis, angle -> pose: turned about an axis, a vector of any length but zero",
        rules.pose_rule("rotation(axis, angle)", Vector(3, Real()), Real(RADIAN)),
        is_overridable=True,
        value=values.rotation,
        constants_checked=True,
        overflows=False,
        propagates=True,
        bounds=_AT_ORIGIN,
        direction=0,
    ),
    m.RPY: BuiltinFunction(
        "roll, pitch, yaw -> pose: turned about the fixed axes x, y and z, in this order",
        rules.pose_rule("rpy(roll, pitch, yaw)", *[Real(RADIAN)] * 3),
        is_overridable=True,
        value=values.rpy,
        may_fail=False,
        overflows=False,
        propagates=True,
        bounds=_AT_ORIGIN,
    ),
    m.POSE: BuiltinFunction(
        "p, q -> pose: q is a quaternion (x, y, z, w)",
        rules.pose_rule(
            "pose(position, quaternion_xyzw)", Vector(3, Real(METRE)), Vector(4, Real())
        ),
        value=values.pose,
        constants_checked=True,
        overflows=False,
        direction=1,
    ),
    m.LENGTH: exact(
        "list -> int: number of items",
        rules.unary_rule(
            "len(list)",
            "counts the items of a list",
            lambda type: Int() if isinstance(type, ListOf) else None,
            lambda type: f"its length is always {type.size}" if isinstance(type, Vector) else "",
        ),
        value=len,
        python="",
        notation="bars",
        bounds=ranges.NOT_NEGATIVE,
        inverse=_from_len,
    ),
    "norm": BuiltinFunction(
        "v -> real: length of a vector, in its unit",
        rules.unary_rule("norm(vector)", "takes a vector of reals", rules.real_element),
        value=lambda v: math.hypot(*v),
        notation="double bars",
        may_fail=False,
        propagates=True,
        bounds=ranges.NOT_NEGATIVE,
        inverse=_from_norm,
        is_costly=True,
    ),
    **NUMBER_FUNCTIONS,
    m.JOINED: exact(
        "list, list -> list: the items of both",
        None,
        value=operator.add,
        python="",
        form=lambda type: _SUM,
    ),
    m.REST: exact(
        "list, n -> list: all items but the first n",
        None,
        value=lambda items, first: items[first:],
        python="",
        form=lambda type: _REST,
        neutral=(1, 0, "the items from the second on are `[1:]`"),
    ),
}

BUILTIN_NAMES = tuple(sorted(name for name, function in FUNCTIONS.items() if function.rule))
_LATER = {name for name, function in FUNCTIONS.items() if function.is_overridable}
RESERVED = frozenset({"True", "False", "x", "y", "_", *CLOCK_NAMES, *BUILTIN_NAMES}) - _LATER
"""Names of the language; a specification gives them to nothing of its own."""
