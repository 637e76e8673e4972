"""The types of the language: all that is known of each constructor stands in one table.

A new one needs a class in `specc.model.types`, which says how it is made, a row here, its spelling
in `specc.lang.types` and a line in `docs/language.md`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from specc.lang.values import Fields, NotRecorded, Token, Value, compose, translation
from specc.model import expr as m
from specc.model import types as t
from specc.model.expr import Expr
from specc.model.types import Type

Of = Callable[[Type, Any], Any]
"""From the type of a part and what there is of the part."""
Sort = Literal["truth", "whole", "real", "item", "other"]


@dataclass(frozen=True, slots=True)
class Python:
    """How generated code says types in some place: as annotations, contracts or forms of values."""

    of: Callable[[Type], str]
    """What it says for another type."""
    own: Callable[[str], str]
    """A name of the runtime."""
    named: Callable[[Type], str]
    """The class or alias of a type that has a name."""
    function: Callable[[str], str] = str
    """A function, `module:name`."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A constructor of types. A column is a function of the type first, unless it is a text.

    Of types that are made of others, a column says how these are put together: it is given `of`
    for them. The defaults are right for types whose values only pass through.
    """

    # What every constructor has.

    first_value: Callable[[Any, float], Value]
    """A value to begin with, as `specc.lang.evaluate` has them: nothing, the identity, the first
    member; where it consists of numbers, of this one."""
    decode: Callable[[Any, Any, Of], Value]
    """The value that data of a recording stands for; `...` for data of another type."""
    contract: Callable[[Any, Python], str]
    """What checks its values where they come from outside (`specc_runtime.contracts`)."""
    form: Callable[[Any, Python], str]
    """How its values are recorded (`specc_runtime.forms`)."""
    annotation: Callable[[Any, Python], str] = lambda type, py: py.named(type)
    """Its type in generated code."""

    # More about values.

    data: Callable[[Any, Value, Of], Any] = lambda type, value, of: str(value)
    """What recordings have of a value."""
    other_values: Callable[[Any, Value], Iterator[Value]] = lambda type, value: iter(())
    """Some values beside a given one."""
    map_parts: Callable[[Any, Value, Of], Value] = lambda type, value, of: value
    """A value with each part as `of` gives it."""
    literal: Callable[[Any, Value, Of], Expr | None] = lambda type, value, of: None
    """The expression of a value; None if there is none."""
    sort: Sort = "other"
    """What proofs take a value for: what is true or false, a number, one of items that are told
    apart and nothing else, or what they do not look into."""

    # How it is told.

    descriptions: Callable[[Any, Callable[[str], str], Callable[[Type], list[str]]], list[str]] = (
        lambda type, frame, of: []
    )
    """In words, with frames as `frame` names them."""
    words: Callable[[Any], tuple[str, ...]] = lambda type: ()
    """Values that are words, in order."""
    shapes: Callable[[Any], tuple[str, ...]] = lambda type: ()
    """What a value looks like in messages of ROS, as `specc.analysis.ros2` names shapes, scalars by
    their messages of `std_msgs`; first the one that it is published in."""


_LONG = re.compile(r"-?([1-9][0-9]{0,4000}|0x[0-9a-f]+)", re.ASCII)
"""Whole numbers beyond 64 bits, in recordings."""


# Scalars.


def _number(type_: t.Int | t.Real, value: Value, of: Of) -> m.Expr:
    return m.Unused(type=type_) if math.isnan(value) else m.Number(value, type=type_)


def _whole(type_: t.Int, data: Any, of: Of) -> Value:
    if type(data) is str and _LONG.fullmatch(data):
        return int(data, 0)
    return data if type(data) is int else ...


def _neighbours(type_: Type, value: Value) -> Iterator[Value]:
    return iter((value + 1, value - 1))


def _in_unit(type_: t.Real | t.Vector, *_: object) -> list[str]:
    return [f"unit {unit}" if str(unit) != "1" else "dimensionless" for unit in type_.units]


# What consists of numbers, or of other values.


def _with_another_first(type_: Type, value: Value) -> Iterator[Value]:
    for part in type_.components[:1]:
        yield from ((first, *value[1:]) for first in other_values(value[0], part))


def _each(type_: t.Vector | t.ListOf, value: Value, of: Of) -> Value:
    return value if type_.is_array else tuple([of(type_.element, item) for item in value])


def _list_of(type_: t.Vector | t.ListOf, value: Value, of: Of) -> list[Any]:
    return [of(type_.element, item) for item in value]


def _items(type_: Type, value: Value, of: Of) -> m.Expr | None:
    types = type_.components or type_.parts * len(value)
    found = [of(part, item) for part, item in zip(types, value, strict=True)]
    return None if None in found else m.Items(tuple(found), type=type_)


def _components(type_: Type, data: Any, of: Of) -> Value:
    types = type_.components
    fits = type(data) is list and len(data) == len(types)
    return tuple(map(of, types, data)) if fits else ...


def _rows(type_: t.Pose, data: Any, of: Of) -> Value:
    if type(data) is not list or len(data) != 16:
        return ...
    numbers = [of(t.Real(), item) for item in data]
    return tuple([tuple(numbers[i : i + 4]) for i in range(0, 16, 4)])


def _unless_none(type_: t.OptionalOf, value: Value, of: Of) -> Value:
    return None if value is None else of(type_.value, value)


def _of_value(type_: t.PartialOf, value: Value, of: Of) -> Value:
    return of(type_.value, value)


def _without_gaps(type_: t.PartialOf, data: Any, of: Of) -> Value:
    if type(data) is not list:
        return ...
    return of(type_.value, [math.nan if item is None else item for item in data])


def _fields(type_: t.Record, value: Value, of: Of) -> dict[str, Any]:
    return {name: of(part, getattr(value, name)) for name, part in type_.fields}


def _another_field(type_: t.Record, value: Value) -> Iterator[Value]:
    for name, part in type_.fields:
        yield from (
            value.with_field(name, other) for other in other_values(getattr(value, name), part)
        )


def _of_fields(type_: t.Record, data: Any, of: Of) -> Value:
    if type(data) is not dict or data.keys() != dict(type_.fields).keys():
        return ...
    return Fields(**{name: of(part, data[name]) for name, part in type_.fields})


def _call(py: Python, name: str, *arguments: object) -> str:
    return f"{py.own(name)}({', '.join(map(str, arguments))})"


def _record(type_: t.Record, py: Python, maker: str) -> str:
    fields = (f"{name}={py.of(part)}" for name, part in type_.fields)
    return _call(py, maker, py.named(type_), *fields)


def _tuple(type_: t.Vector | t.ListOf, py: Python) -> str:
    return f"tuple[{py.of(type_.element)}, ...]"


def _vector_shapes(type_: t.Vector) -> tuple[str, ...]:
    if not type_.is_array:
        return ("tuple",) if isinstance(type_.element, t.Int) else ()
    sized = {3: ("vector3",), 4: ("camera",)}.get(type_.size, ())
    return (*sized, "vector", "joints") if type_.frame else ("vector", "joints", *sized)


def _instance_of(kind: type) -> Callable[[Type, Any, Of], Value]:
    """Data of a class, which is the value."""
    return lambda type_, data, of: data if type(data) is kind else ...


_text = partial(
    Kind,
    first_value=lambda type, number: "",
    decode=_instance_of(str),
    annotation=lambda type, py: "str",
    contract=lambda type, py: py.own("as_text"),
    form=lambda type, py: py.own("TEXT"),
)


# The table.


KINDS: dict[type[Type], Kind] = {
    t.Bool: Kind(
        first_value=lambda type, number: False,
        other_values=lambda type, value: iter((not value,)),
        literal=lambda type, value, of: m.Truth(value, type=type),
        data=lambda type, value, of: bool(value),
        decode=_instance_of(bool),
        words=lambda type: ("False", "True"),
        shapes=lambda type: ("Bool",),
        annotation=lambda type, py: "bool",
        contract=lambda type, py: py.own("as_bool"),
        form=lambda type, py: py.own("TRUTH"),
        sort="truth",
    ),
    t.Int: Kind(
        first_value=lambda type, number: int(number),
        other_values=_neighbours,
        literal=_number,
        data=lambda type, value, of: int(value),
        decode=_whole,
        shapes=lambda type: ("Int64",),
        annotation=lambda type, py: "int",
        contract=lambda type, py: py.own("as_int"),
        form=lambda type, py: py.own("INTEGER"),
        sort="whole",
    ),
    t.Real: Kind(
        first_value=lambda type, number: number,
        other_values=_neighbours,
        literal=_number,
        data=lambda type, value, of: float(value),
        decode=lambda type_, data, of: float(data) if type(data) in (float, int) else ...,
        descriptions=_in_unit,
        shapes=lambda type: ("Float64", "joints"),
        annotation=lambda type, py: "float",
        contract=lambda type, py: py.own("as_real"),
        form=lambda type, py: py.own("REAL"),
        sort="real",
    ),
    t.Text: _text(
        literal=lambda type, value, of: m.TextLiteral(value, type=type),
        shapes=lambda type: ("String",),
        sort="item",
    ),
    t.File: _text(),
    t.Enum: Kind(
        first_value=lambda type, number: type.members[0],
        other_values=lambda type, value: (member for member in type.members if member != value),
        literal=lambda type, value, of: m.Member(value, type=type),
        decode=lambda type, data, of: data if data in type.members else ...,
        words=lambda type: type.members,
        shapes=lambda type: ("String",),
        contract=lambda type, py: _call(py, "as_member", *map(repr, type.members)),
        form=lambda type, py: py.own("TEXT"),
        sort="item",
    ),
    t.Vector: Kind(
        first_value=lambda type, number: (first_value(type.element, number),) * type.size,
        other_values=_with_another_first,
        map_parts=_each,
        literal=_items,
        data=_list_of,
        decode=_components,
        descriptions=_in_unit,
        shapes=_vector_shapes,
        annotation=lambda type, py: py.own("Vector") if type.is_array else _tuple(type, py),
        contract=lambda type, py: (
            _call(py, "as_vector", type.size)
            if type.is_array
            else _call(py, "as_tuple", py.of(type.element), type.size)
        ),
        form=lambda type, py: (
            _call(py, "array", type.size)
            if type.is_array
            else _call(py, "items", py.of(type.element))
        ),
    ),
    t.Spatial: Kind(
        first_value=lambda type, number: (number,) * 6,
        other_values=_with_another_first,
        literal=_items,
        data=lambda type, value, of: [float(number) for number in value],
        decode=_components,
        descriptions=lambda type, frame, of: [
            f"in the axes of {frame(type.frame)}; units {type.linear} and {type.angular}"
        ],
        shapes=lambda type: tuple({str(type).partition("[")[0]} & t.SPATIAL_KINDS.keys()),
        annotation=lambda type, py: py.own("Spatial"),
        contract=lambda type, py: _call(py, "as_vector", 6),
        form=lambda type, py: _call(py, "array", 6),
    ),
    t.Pose: Kind(
        first_value=lambda type, number: translation(0.0, 0.0, 0.0),
        other_values=lambda type, value: iter((compose(value, translation(1.0, 0.0, 0.0)),)),
        data=lambda type, value, of: [float(number) for row in value for number in row],
        decode=_rows,
        descriptions=lambda type, frame, of: [
            f"pose of {frame(type.child)} in {frame(type.parent)}"
        ],
        shapes=lambda type: ("pose", "transform"),
        annotation=lambda type, py: py.own("Pose"),
        contract=lambda type, py: py.own("as_pose"),
        form=lambda type, py: _call(py, "array", 4, 4),
    ),
    t.Image: Kind(
        first_value=lambda type, number: Token("image"),
        data=lambda type, value, of: [type.height, type.width, 3][: 3 if type.channels == 3 else 2],
        decode=lambda type, data, of: NotRecorded(),
        descriptions=lambda type, frame, of: ["a depth map, unit m"] * (type.channels == 1),
        shapes=lambda type: ("image" if type.channels == 3 else "depth",),
        annotation=lambda type, py: py.own("Rgb" if type.channels == 3 else "Depth"),
        contract=lambda type, py: _call(
            py, "as_rgb" if type.channels == 3 else "as_depth", type.height, type.width
        ),
        form=lambda type, py: _call(py, "image", type.height, type.width, type.channels),
    ),
    t.ListOf: Kind(
        first_value=lambda type, number: (first_value(type.element),) * type.nonempty,
        other_values=lambda type, value: iter(((*value, first_value(type.element)),)),
        map_parts=_each,
        literal=_items,
        data=_list_of,
        decode=lambda type_, data, of: (
            tuple([of(type_.element, item) for item in data]) if type(data) is list else ...
        ),
        descriptions=lambda type, frame, of: [f"each: {words}" for words in of(type.element)],
        shapes=lambda type: ("records", "trajectory") * isinstance(type.element, t.Record),
        annotation=_tuple,
        contract=lambda type, py: _call(
            py, "as_list", py.of(type.element), *["least=1"] * type.nonempty
        ),
        form=lambda type, py: _call(py, "items", py.of(type.element)),
    ),
    t.OptionalOf: Kind(
        first_value=lambda type, number: None,
        map_parts=_unless_none,
        literal=lambda type, value, of: (
            m.Nothing(type=type) if value is None else of(type.value, value)
        ),
        data=_unless_none,
        decode=_unless_none,
        descriptions=lambda type, frame, of: ["or None", *of(type.value)],
        annotation=lambda type, py: f"{py.of(type.value)} | None",
        contract=lambda type, py: _call(py, "as_optional", py.of(type.value)),
        form=lambda type, py: _call(py, "optional", py.of(type.value)),
    ),
    t.PartialOf: Kind(
        first_value=lambda type, number: first_value(type.value, number),
        other_values=lambda type, value: other_values(value, type.value),
        literal=_of_value,
        data=_of_value,
        decode=_without_gaps,
        descriptions=lambda type, frame, of: ["or without some components", *of(type.value)],
        annotation=lambda type, py: py.of(type.value),
        contract=lambda type, py: _call(py, "as_partial", len(type.value.components)),
        form=lambda type, py: py.of(type.value),
    ),
    t.Record: Kind(
        first_value=lambda type, number: Fields(
            **{n: first_value(of, number) for n, of in type.fields}
        ),
        other_values=_another_field,
        map_parts=lambda type, value, of: Fields(**_fields(type, value, of)),
        data=_fields,
        decode=_of_fields,
        shapes=lambda type: ("record", "trajectory"),
        contract=lambda type, py: _record(type, py, "as_record"),
        form=lambda type, py: _record(type, py, "record"),
    ),
    t.Opaque: Kind(
        first_value=lambda type, number: Token(type.name),
        other_values=lambda type, value: iter((Token(f"another {type.name}"),)),
        decode=lambda type, data, of: NotRecorded(),
        contract=lambda type, py: _call(
            py, "as_instance", py.named(type) if type.python else "object"
        ),
        form=lambda type, py: _call(py, "opaque", repr(type.name), *map(py.function, type.codec)),
    ),
}


def kind(type_: Type) -> Kind:
    """The row of a type."""
    return KINDS[type(type_)]


def first_value(type_: Type, number: float = 0.0) -> Value:
    """A value of a type: nothing, the number, the first member, the identity."""
    return KINDS[type(type_)].first_value(type_, number)


def other_values(value: Value, type_: Type) -> Iterator[Value]:
    """Some values of a type beside a given one."""
    return KINDS[type(type_)].other_values(type_, value)
