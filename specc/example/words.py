"""Values in the words of a specification, in SI units."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence

from specc.example.values import Value
from specc.model.types import (
    Bool,
    Enum,
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
from specc.model.units import DIMENSIONLESS, Unit

MOST_ITEMS, MOST_OTHERS = 8, 3


def worded(value: Value, type_: Type) -> str | None:
    """`0.2 s`, `[u, u, g]`, `translation(0, 0, 1)`; None for what only operators look into."""
    if value is None:
        return "None"
    match type_:
        case Int() | Real():
            return number(value) + unit(type_)
        case Pose() | Spatial() | Vector(element=Real()):
            return _numbers(value, type_)
        case Vector(element=element) | ListOf(element=element):
            return _items([worded(item, element) for item in value])
        case Record(fields=fields):
            return _record([(name, worded(getattr(value, name), t)) for name, t in fields])
        case OptionalOf(value=inner) | PartialOf(value=inner):
            return worded(value, inner)
    simple = _SIMPLE.get(type(type_))
    return simple(value) if simple else None


_SIMPLE: dict[type[Type], Callable[[Value], str]] = {
    Bool: lambda value: "true" if value else "false",
    Enum: str,
    Text: repr,
}


def number(value: float) -> str:
    """A number as it is read back, without a needless fraction; `_` for a missing component."""
    if math.isnan(value):
        return "_"
    return repr(value).removesuffix(".0")


def unit(type_: Type) -> str:
    """The unit of a number with a space before it; nothing for plain numbers."""
    kind = type_.unit if isinstance(type_, Real) else DIMENSIONLESS
    return "" if kind == DIMENSIONLESS else f" {_spelled(kind)}"


def _spelled(kind: Unit) -> str:
    return str(kind.coherent())


def _items(items: Sequence[str | None]) -> str | None:
    known = [item for item in items if item is not None]
    return _listed(known) if len(known) == len(items) else None


def _listed(items: Sequence[str]) -> str:
    """All items; of very many the usual one and those that differ, or the first ones."""
    if len(items) <= MOST_ITEMS:
        return f"[{', '.join(items)}]"
    usual = Counter(items).most_common(1)[0][0]
    others = [f"[{index}] = {item}" for index, item in enumerate(items) if item != usual]
    if len(others) <= MOST_OTHERS:
        return " and ".join([f"[{usual}, {usual}, ...]", *others])
    return f"[{', '.join(items[:MOST_ITEMS])}, ...]"


def _record(fields: Sequence[tuple[str, str | None]]) -> str | None:
    known = [f"{name}: {text}" for name, text in fields if text is not None]
    return f"{{{', '.join(known)}}}" if known else None


def _numbers(value: Value, type_: Type) -> str:
    if isinstance(type_, Pose):
        return _pose(value)
    listed = _listed([number(item) for item in value])
    return listed + (unit(type_.element) if isinstance(type_, Vector) else "")


def _pose(rows: Value) -> str:
    match rows:
        case ((1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, y), (0.0, 0.0, 1.0, z), _):
            moved = ", ".join(map(number, (x, y, z)))
            return f"translation({moved})" if any((x, y, z)) else "identity()"
    return _listed([_listed([number(item) for item in row]) for row in rows])
