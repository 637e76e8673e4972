"""Values of any type: random ones, and the way between the runtime's values and plain ones.

Poses are twelve turns whose matrices are whole numbers, so that a product comes out the same in
whatever order it is added up.
"""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass, replace
from random import Random
from types import SimpleNamespace
from typing import Any

import numpy as np

from specc.model.types import (
    Bool,
    Enum,
    Image,
    Int,
    ListOf,
    OptionalOf,
    PartialOf,
    Pose,
    Real,
    Record,
    Spatial,
    Text,
    Type,
    Vector,
)

TURNS = [
    tuple(tuple(float(s * (j == p)) for j in range(3)) for p, s in zip(perm, signs, strict=True))
    for perm in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
]
IDENTITY = (
    (1.0, 0.0, 0.0, 0.0),
    (0.0, 1.0, 0.0, 0.0),
    (0.0, 0.0, 1.0, 0.0),
    (0.0, 0.0, 0.0, 1.0),
)
NASTY = (0.0, -0.0, 5e-324, -1e-9, 1e-9, 1e16, -1e16, 1e100)
EXTREMES = (*NASTY, 1e200, 1.7e308, -1.7e308)
HUGE = (2**53 + 1, -(2**63), 2**64, 10**400)


class Chooser:
    """Random values of types; `marks` are numbers that the specification compares with."""

    def __init__(
        self, rng: Random, marks: tuple[float, ...] = (), odd: tuple[float, ...] = ()
    ) -> None:
        """`odd` are values that are tried now and then, such as infinities."""
        self.rng = rng
        self.marks = marks
        self.odd = odd

    def value(self, type_: Type) -> Any:  # noqa: C901  # a case for each type
        """A plain value."""
        rng = self.rng
        match type_:
            case Bool():
                return rng.random() < 0.5
            case Int():
                if self.odd and rng.random() < 0.05:
                    return rng.choice(HUGE)
                near = [int(m) for m in self.marks if float(m).is_integer() and abs(m) < 1e6]
                if near and rng.random() < 0.4:
                    return rng.choice(near) + rng.choice((-1, 0, 1))
                return rng.randint(-3, 3)
            case Real():
                return self.number()
            case Enum():
                return rng.choice(type_.members)
            case Text():
                return rng.choice(("", "a", "b"))
            case Vector():
                if isinstance(type_.element, Enum) and rng.random() < 0.3:
                    return (rng.choice(type_.element.members),) * type_.size
                if isinstance(type_.element, Real) and rng.random() < 0.3:
                    return (self.number(),) * type_.size
                return tuple(self.value(type_.element) for _ in range(type_.size))
            case Spatial():
                return tuple(self.number() for _ in range(6))
            case ListOf():
                return tuple(self.value(type_.element) for _ in range(self._size(type_)))
            case PartialOf():
                whole = self.value(type_.value)
                return tuple(math.nan if rng.random() < 0.5 else number for number in whole)
            case OptionalOf():
                return None if rng.random() < 0.3 else self.value(type_.value)
            case Pose():
                if rng.random() < 0.4:
                    return IDENTITY
                turn = rng.choice(TURNS)
                return (*((*row, rng.randint(-24, 24) / 8) for row in turn), (0.0, 0.0, 0.0, 1.0))
            case Record():
                return self._record(type_)
            case Image():
                return ("image", rng.randrange(4))
        return ("token", str(type_), rng.randrange(4))

    def _size(self, type_: ListOf) -> int:
        return max(self.rng.choice((0, 1, 1, 2, 3)), type_.nonempty)

    def number(self) -> float:
        """A small number, one that is compared with, a neighbour of it, or an odd one."""
        rng = self.rng
        way = rng.random()
        if self.marks and way < 0.35:
            mark = rng.choice(self.marks)
            return rng.choice(
                (mark, -mark, math.nextafter(mark, math.inf), math.nextafter(mark, -math.inf))
            )
        if self.odd and way < 0.5:
            return rng.choice(self.odd)
        return rng.randint(-24, 24) / 8

    def _record(self, type_: Record) -> Any:
        parts = {name: self.value(t) for name, t in type_.fields}
        return record(type_, parts)


def record(type_: Record, parts: dict[str, Any]) -> Any:
    """A record; where its own class is the specification's, a stand-in with the same fields."""
    if type_.python.startswith("tests."):
        from importlib import import_module

        module, _, name = type_.python.partition(":")
        return getattr(import_module(module), name)(**parts)
    return SimpleNamespace(**parts)


def for_runtime(value: Any, type_: Type) -> Any:
    """A plain value as generated code has it."""
    match type_:
        case Pose() | Spatial() | Vector(element=Real()) | PartialOf():
            made = np.array(value, dtype=float)
            made.setflags(write=False)
            return made
        case OptionalOf(value=there):
            return None if value is None else for_runtime(value, there)
        case ListOf(element=element):
            return tuple(for_runtime(item, element) for item in value)
        case Record():
            parts = {name: for_runtime(getattr(value, name), t) for name, t in type_.fields}
            return replace(value, **parts) if is_dataclass(value) else SimpleNamespace(**parts)  # type: ignore[type-var]  # an instance
        case Real():
            return float(value)
    return value


def plain(value: Any) -> Any:
    """A value of generated code as a plain one."""
    if isinstance(value, np.ndarray):
        return tuple(plain(item) for item in value.tolist())
    if isinstance(value, (list, tuple)):
        return tuple(map(plain, value))
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{f.name: plain(getattr(value, f.name)) for f in fields(value)})
    if isinstance(value, SimpleNamespace):
        return SimpleNamespace(**{name: plain(part) for name, part in vars(value).items()})
    return value


PRODUCTS = 1e-12
"""How far products of poses may be apart: libraries add up in any order."""


def is_pose(value: Any) -> bool:
    """Whether a plain value is a matrix of 4 by 4."""
    rows = value if isinstance(value, tuple) and len(value) == 4 else ()
    return bool(rows) and all(isinstance(row, tuple) and len(row) == 4 for row in rows)


def same(a: Any, b: Any, tolerance: float = 0.0) -> bool:
    """Whether two plain values are equal but for the sign of zero; NaN is NaN.

    `tolerance` is relative, absolute below 1; for poses it is at least `PRODUCTS`.
    """
    if isinstance(a, tuple) and isinstance(b, tuple):
        if is_pose(a):
            tolerance = max(tolerance, PRODUCTS)
        return len(a) == len(b) and all(same(p, q, tolerance) for p, q in zip(a, b, strict=True))
    if isinstance(a, float) and isinstance(b, float):
        both_nan = math.isnan(a) and math.isnan(b)
        return both_nan or math.isclose(a, b, rel_tol=tolerance, abs_tol=tolerance)
    if isinstance(a, SimpleNamespace) and isinstance(b, SimpleNamespace):
        return vars(a).keys() == vars(b).keys() and all(
            same(part, vars(b)[name], tolerance) for name, part in vars(a).items()
        )
    if is_dataclass(a) and type(a) is type(b):
        return all(same(getattr(a, f.name), getattr(b, f.name), tolerance) for f in fields(a))  # type: ignore[arg-type]  # an instance
    return bool(a == b)


def key_of(value: Any) -> str:
    """A text that is the same for values that are equal but for rounding."""
    value = plain(value)
    if isinstance(value, tuple):
        return f"({','.join(map(key_of, value))})"
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        if is_dataclass(value):
            return f"[{','.join(key_of(getattr(value, f.name)) for f in fields(value))}]"
        if isinstance(value, SimpleNamespace):
            return f"[{','.join(key_of(v) for _, v in sorted(vars(value).items()))}]"
        return repr(value)
    return f"{float(value) + 0.0:.9g}"
