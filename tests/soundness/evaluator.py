"""What a typed expression means, read off docs/language.md, on plain Python values.

A vector, spatial vector or list is a tuple, a pose a tuple of four rows, a member of an enum its
name, `_` NaN. This is the tests' own reading, apart from `specc.lang.evaluate`: numbers are IEEE
doubles; what divides by zero or overflows raises.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from specc.model import expr as m
from specc.model.types import Pose, Real, Spatial, Vector

Key = tuple[str, str]
Value = Any


class Absent(Exception):
    """An input was read that has no value."""


@dataclass(slots=True)
class Situation:
    """All that an expression may ask for at one time stamp."""

    inputs: Mapping[Key, Value]
    fresh: frozenset[Key]
    memory: Mapping[str, Value]
    lets: Mapping[str, m.Expr]
    constants: Mapping[str, Value]
    operators: Mapping[str, Callable[..., Value]]
    elapsed: float = 0.0
    entered: bool = True
    period: float = 0.0
    files: Mapping[str, str] = field(default_factory=dict)
    ages: Mapping[Key, float] = field(default_factory=dict)
    live: Mapping[str, Value] = field(default_factory=dict)
    """Constants that may change, as they are in this period."""
    known: dict[str, Value] = field(default_factory=dict)
    """Lets that were computed in this period."""
    bound: dict[str, Value] = field(default_factory=dict)
    empty: list[str] = field(default_factory=list)
    """What was said to be there and was not: types of values that are None, of lists of nothing."""


def value(e: m.Expr, at: Situation) -> Value:  # noqa: C901  # a case for each kind of node
    """The value of an expression; raises `Absent`, and what arithmetic and operators raise."""
    match e:
        case m.Number() | m.Truth() | m.TextLiteral():
            return e.value
        case m.Member(name=name):
            return name
        case m.Unused():
            return math.nan
        case m.Nothing():
            return None
        case m.Input(peer=peer, element=element):
            if (peer, element) not in at.inputs:
                raise Absent(f"x.{peer}.{element}")
            return at.inputs[peer, element]
        case m.MemoryRef(name=name):
            return at.memory[name]
        case m.ConstantRef(name=name):
            return at.constants[name]
        case m.Live(name=name):
            return at.live[name]
        case m.FileRef(name=name):
            return at.files[name]
        case m.BoundVariable(name=name):
            return at.bound[name]
        case m.LetRef(name=name):
            if name not in at.known:
                outside, at.bound = at.bound, {}
                at.known[name] = value(at.lets[name], at)
                at.bound = outside
            return at.known[name]
        case m.Clock(name=name):
            return getattr(at, name)
        case m.Fresh(input=asked):
            return (asked.peer, asked.element) in at.fresh
        case m.Present(input=asked):
            return (asked.peer, asked.element) in at.inputs
        case m.Lag(name=name, input=asked):
            if (asked.peer, asked.element) not in at.inputs:
                raise Absent(f"x.{asked.peer}.{asked.element}")
            return at.ages[asked.peer, asked.element] if name == "age" else 0
        case m.Call(operator=name, args=args):
            return at.operators[name](*[value(a, at) for a in args])
        case m.Builtin(name=name, args=args):
            return _finite(_BUILTINS[name](*[value(a, at) for a in args]))
        case m.FieldOf(value=record, name=name):
            return getattr(value(record, at), name)
        case m.Component(value=vector, index=index):
            return value(vector, at)[index]
        case m.Items(items=items):
            found = tuple(value(item, at) for item in items)
            real = isinstance(e.type, Spatial)
            real |= isinstance(e.type, Vector) and isinstance(e.type.element, Real)
            return tuple(float(item) for item in found) if real else found
    return _computed(e, at)


def _computed(e: m.Expr, at: Situation) -> Value:  # as above
    match e:
        case m.Unary(op="not", operand=operand):
            return not value(operand, at)
        case m.Unary(operand=operand):
            v = value(operand, at)
            return tuple(-c for c in v) if isinstance(v, tuple) else -v
        case m.Logic(op="and", operands=operands):
            return all(value(operand, at) for operand in operands)
        case m.Logic(operands=operands):
            return any(value(operand, at) for operand in operands)
        case m.Choice(test=test, then=then, otherwise=otherwise):
            return value(then, at) if value(test, at) else value(otherwise, at)
        case m.Compare(op=op, left=left, right=right):
            return _compared(op, value(left, at), value(right, at))
        case m.IsNone(value=optional):
            return value(optional, at) is None
        case m.Unwrap(value=doubtful):
            return _sure(doubtful, at)
        case m.IsOneOf(item=item, members=members):
            return value(item, at) in members
        case m.Quantifier():
            return _quantified(e, at)
        case m.Binary(op="@", left=left, right=right):
            of = composed if isinstance(e.type, Pose) else _moved
            return _finite(of(value(left, at), value(right, at)))
        case m.Binary(op=op, left=left, right=right):
            return _finite(_calculated(op, value(left, at), value(right, at)))
    raise TypeError(f"{e!r} has no value")


def _sure(doubtful: m.Expr, at: Situation) -> Value:
    """A value that must be there; a list that must have an item."""
    found = value(doubtful, at)
    if found is None or found == ():
        at.empty.append(str(doubtful.type))
    if found is None:
        raise ValueError("there is no value")
    return found


def _extreme(e: m.Quantifier, at: Situation) -> Value:
    """The first item with the largest or smallest number."""
    items = value(e.over, at)
    if not items:
        raise ValueError("there is no item")
    best, record = items[0], None
    for item in items:
        outside, at.bound = at.bound, {**at.bound, e.variable: item}
        number = value(e.body, at)
        at.bound = outside
        if record is None or (number > record if e.kind == "argmax" else number < record):
            best, record = item, number
    return best


def _quantified(e: m.Quantifier, at: Situation) -> Value:
    if e.kind in ("argmax", "argmin"):
        return _extreme(e, at)
    for item in value(e.over, at):
        outside, at.bound = at.bound, {**at.bound, e.variable: item}
        holds = value(e.body, at)
        at.bound = outside
        if holds != (e.kind == "all"):
            return e.kind == "any"
    return e.kind == "all"


def _compared(op: str, a: Value, b: Value) -> bool:
    match op:
        case "<":
            return a < b
        case "<=":
            return a <= b
        case ">":
            return a > b
        case ">=":
            return a >= b
        case "==":
            return a == b
    return a != b


def _calculated(op: str, a: Value, b: Value) -> Value:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return tuple(_calculated(op, p, q) for p, q in zip(a, b, strict=True))
    if isinstance(a, tuple):
        return tuple(_calculated(op, p, b) for p in a)
    if isinstance(b, tuple):
        return tuple(_calculated(op, a, q) for q in b)
    match op:
        case "+":
            return a + b
        case "-":
            return a - b
        case "*":
            return a * b
        case "/":
            return a / b
    return a**b


def _finite(number: Value) -> Value:
    """A number, or the numbers of a vector or pose, none of them too large for a float."""
    parts = number if isinstance(number, tuple) else (number,)
    for part in parts:
        if isinstance(part, tuple):
            _finite(part)
        elif isinstance(part, float) and not math.isfinite(part):
            raise OverflowError("a number is too large")
    return number


# Poses: rows of homogeneous transforms -------------------------------------------------

Rows = tuple[tuple[float, ...], ...]
LAST = (0.0, 0.0, 0.0, 1.0)


def composed(X: Rows, Y: Rows) -> Rows:
    """X_AC of X_AB and X_BC: axes turned, origin carried over and added."""
    rows = []
    for row in X[:3]:
        turned = [_dot(row[:3], [Y[k][j] for k in range(3)]) for j in range(3)]
        rows.append((*turned, _dot(row[:3], [Y[k][3] for k in range(3)]) + row[3]))
    return (*rows, LAST)


def _moved(X: Rows, p: Any) -> tuple[float, ...]:
    return tuple(_dot(row[:3], p) + row[3] for row in X[:3])


def _inverse(X: Rows) -> Rows:
    p = [row[3] for row in X[:3]]
    columns = [tuple(X[i][j] for i in range(3)) for j in range(3)]
    return (*((*c, -_dot(c, p)) for c in columns), LAST)


def _dot(a: Any, b: Any) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _translation(x: float, y: float, z: float) -> Rows:
    return ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), LAST)


def _rotation(axis: Any, angle: float) -> Rows:
    """By the quaternion of half the angle."""
    largest = max(abs(part) for part in axis)
    if largest == 0.0:
        raise ValueError("no direction")
    x, y, z = (part / largest for part in axis)
    length, s = math.sqrt(x * x + y * y + z * z), math.sin(angle / 2)
    return _pose(
        (0.0, 0.0, 0.0), (s * x / length, s * y / length, s * z / length, math.cos(angle / 2))
    )


def _rpy(roll: float, pitch: float, yaw: float) -> Rows:
    X = _rotation((0.0, 0.0, 1.0), yaw)
    for axis, angle in (((0.0, 1.0, 0.0), pitch), ((1.0, 0.0, 0.0), roll)):
        X = composed(X, _rotation(axis, angle))
    return X


def _pose(p: Any, q: Any) -> Rows:
    x, y, z, w = q
    n = x * x + y * y + z * z + w * w
    if not 0.0 < n < math.inf:
        raise ValueError("no direction")
    t = 2 / n
    return (
        (1 - t * (y * y + z * z), t * (x * y - z * w), t * (x * z + y * w), p[0]),
        (t * (x * y + z * w), 1 - t * (x * x + z * z), t * (y * z - x * w), p[1]),
        (t * (x * z - y * w), t * (y * z + x * w), 1 - t * (x * x + y * y), p[2]),
        LAST,
    )


def _near(a: Value, b: Value, tolerance: float, angle: float | None = None) -> bool:
    if angle is not None:
        apart = math.dist([row[3] for row in a[:3]], [row[3] for row in b[:3]])
        return _finite(apart) <= tolerance and _turn(a, b) <= angle
    if isinstance(a, tuple):
        return all(_near(p, q, tolerance) for p, q in zip(a, b, strict=True))
    return _finite(abs(a - b)) <= tolerance


def _turn(X: Rows, Y: Rows) -> float:
    """Angle between two orientations, from the trace of one times the transpose of the other."""
    trace = sum(X[i][k] * Y[i][k] for i in range(3) for k in range(3))
    return math.acos(max(-1.0, min(1.0, (trace - 1.0) / 2.0)))


# Numbers: exact fractions, or comparisons ----------------------------------------------

_PI = Fraction(math.pi)


def _clamp(a: Value, low: Value, high: Value) -> Value:
    if high < low or a > high:
        return high
    return low if a < low else a


def _sign(a: float) -> int:
    return 0 if a == 0 else 1 if a > 0 else -1


def _floor(a: float) -> int:
    whole = int(a)  # cut off towards zero
    return whole - 1 if whole > a else whole


def _round(a: float) -> int:
    """The nearer of the two whole numbers around it; the even one if both are as near."""
    below = _floor(a)
    up, down = below + 1 - Fraction(a), Fraction(a) - below
    if up == down:
        return below if below % 2 == 0 else below + 1
    return below + 1 if up < down else below


def _wrap_angle(a: float) -> float:
    """Whole turns taken off until it is from -pi to pi, without pi; no result is rounded."""
    turns = _floor((Fraction(a) + _PI) / (2 * _PI))
    exact = Fraction(a) - 2 * _PI * turns
    assert -_PI <= exact < _PI and Fraction(float(exact)) == exact
    return float(exact)


_BUILTINS: dict[str, Callable[..., Value]] = {
    "near": _near,
    "inverse": _inverse,
    "position": lambda X: tuple(row[3] for row in X[:3]),
    "identity": lambda: _translation(0.0, 0.0, 0.0),
    "translation": _translation,
    "rotation": _rotation,
    "rpy": _rpy,
    "pose": _pose,
    "norm": lambda v: math.hypot(*v),
    "len": len,
    "abs": abs,
    "sqrt": math.sqrt,
    "joined": lambda v, w: (*v, *w),
    "rest": lambda v, n: v[n:],
    "sin": math.sin,
    "cos": math.cos,
    "atan2": math.atan2,
    "clamp": _clamp,
    "hypot": math.hypot,
    "sign": _sign,
    "floor": _floor,
    "round": _round,
    "wrap_angle": _wrap_angle,
    "min": min,
    "max": max,
}
