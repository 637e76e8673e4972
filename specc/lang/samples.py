"""Values of every type: one to begin with, others, and how they are written.

They are those of `specc.lang.evaluate`: a vector is a tuple, a pose a tuple of rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from specc.lang.values import compose, translation
from specc.model.types import (
    Bool,
    Enum,
    File,
    Image,
    Int,
    ListOf,
    Opaque,
    OptionalOf,
    Pose,
    Real,
    Record,
    Spatial,
    Text,
    Type,
    Vector,
    whole,
)

Value = Any

_RELATIVE, _ABSOLUTE = 1e-9, 1e-12
"""What rounding may make of equal numbers."""


class Token:
    """A value that only operators look into; tokens of one name are equal."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Token) and other.name == self.name

    def __hash__(self) -> int:
        return hash(self.name)

    def __repr__(self) -> str:
        return f"Token({self.name!r})"


class Fields:
    """The value of a record; its fields are attributes."""

    def __init__(self, **fields: Value) -> None:
        self.__dict__.update(fields)

    def __iter__(self) -> Iterator[tuple[str, Value]]:
        return iter(self.__dict__.items())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Fields) and self.__dict__ == other.__dict__

    def __hash__(self) -> int:
        return hash(tuple(self.__dict__.items()))

    def __repr__(self) -> str:
        return f"Fields({', '.join(f'{name}={spelled(value)}' for name, value in self)})"

    def having(self, name: str, value: Value) -> Fields:
        """The same record with another value of one field."""
        return Fields(**{**self.__dict__, name: value})


_SIMPLE: dict[type[Type], Value] = {
    Bool: False,
    Text: "",
    File: "",
    ListOf: (),
    Pose: translation(0.0, 0.0, 0.0),
    OptionalOf: None,
    Image: Token("image"),
}


def first_value(type_: Type, number: float = 0.0) -> Value:
    """A value of a type: nothing, the number, the first member, the identity."""
    match whole(type_):
        case Real() | Int():
            return number if isinstance(type_, Real) else int(number)
        case Enum(members=members):
            return members[0]
        case Vector(size=size, element=element):
            return (first_value(element, number),) * size
        case Spatial():
            return (number,) * 6
        case Record(fields=fields):
            return Fields(**{name: first_value(inner, number) for name, inner in fields})
        case ListOf(element=element, nonempty=True):
            return (first_value(element),)
        case Opaque(name=name):
            return Token(name)
    return _SIMPLE[type(type_)]


def others(value: Value, type_: Type) -> Iterator[Value]:
    """Some values of a type beside a given one."""
    match whole(type_):
        case Bool():
            yield not value
        case Int() | Real():
            yield value + 1
            yield value - 1
        case Enum(members=members):
            yield from (member for member in members if member != value)
        case Vector() | Spatial() if value:
            part: Type = type_.element if isinstance(type_, Vector) else Real()
            yield from ((first, *value[1:]) for first in others(value[0], part))
        case Pose():
            yield compose(value, translation(1.0, 0.0, 0.0))
        case ListOf(element=element):
            yield (*value, first_value(element))
        case Record(fields=fields):
            for name, inner in fields:
                yield from (value.having(name, v) for v in others(getattr(value, name), inner))
        case Opaque(name=name):
            yield Token(f"another {name}")


def spelled(value: Value) -> str:
    """A value as it is written in a test."""
    match value:
        case float():
            return repr(value) if math.isfinite(value) else f'float("{value}")'
        case ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), (0.0, 0.0, 0.0, 1.0)):
            return f"translation({x!r}, {y!r}, {z!r})"
        case tuple():
            inside = ", ".join(map(spelled, value))
            return f"({inside},)" if len(value) == 1 else f"({inside})"
    return repr(value)


def alike(a: Value, b: Value) -> bool:
    """Whether two values are the same but for rounding; NaN is like NaN."""
    if isinstance(a, tuple) and isinstance(b, tuple):
        return len(a) == len(b) and all(map(alike, a, b))
    if isinstance(a, Fields) and isinstance(b, Fields):
        return alike(tuple(a), tuple(b))
    if isinstance(a, float) and isinstance(b, (int, float)):
        both_nan = math.isnan(a) and math.isnan(b)
        return both_nan or math.isclose(a, b, rel_tol=_RELATIVE, abs_tol=_ABSOLUTE)
    return bool(a == b)
