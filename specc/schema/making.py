"""Parts made of data that have the shape of a file; where they do not, `shape` says what is wrong.

What makes values of a kind is put together once for each kind. It knows no places, since it tells
nothing: it gives up at the first value that is not right.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from typing import Any, TypeVar

from specc.schema.keys import (
    OTHERS,
    Named,
    OneOf,
    Optional,
    Part,
    Several,
    Text,
    Truth,
    Whole,
)
from specc.schema.unfold import Unfolded

Make = Callable[[Any], Any]
P = TypeVar("P", bound=Part)
_SCALARS = (str, int, float)

# Whole numbers and truth values may stand in quotes.
_DIGITS = re.compile(r"\s*([+-]?\d+(?:_\d+)*)(?:\.0+)?\s*", re.ASCII)
_MOST_DIGITS = 400
_TRUTHS: dict[object, bool] = {
    **dict.fromkeys((1, "1", "true", "t", "yes", "y", "on"), True),
    **dict.fromkeys((0, "0", "false", "f", "no", "n", "off"), False),
}


class Unlike(Exception):
    """Data are not of the shape that they should have."""


def made(part: type[P], data: object) -> P:
    """A mapping made of data. Raises `Unlike`."""
    return maker(part)(data)  # type: ignore[no-any-return]  # of that class


def maker(kind: Any) -> Make:
    """What makes a value of a kind, and raises `Unlike` for data that are none."""
    return _MAKERS[type(kind)](kind)


def spelled(part: type[Part], value: Any) -> tuple[tuple[str, ...], Collection[Any]]:
    """The keys that a mapping, or a short form of it, gives, and their values. Raises `Unlike`."""
    if isinstance(value, dict):
        return tuple(value), value.values()
    if part.short and isinstance(value, _SCALARS):
        return (part.short,), (value,)
    if part.row and isinstance(value, list) and len(value) == len(part.row):
        return part.row, value
    raise Unlike


def in_full(part: type[Part], value: Any) -> Any:
    """The mapping that a short form stands for; any other value as it is."""
    try:
        return value if isinstance(value, dict) else dict(zip(*spelled(part, value), strict=True))
    except Unlike:
        return value


def others_apart(part: type[Part], data: dict[str, Any]) -> dict[str, Any]:
    """The parts with names that people choose. With a mapping, `is` is such a name, not a key."""
    if part.known.isdisjoint(data):
        return {OTHERS: data}
    own = {
        name
        for name, value in data.items()
        if name in part.known and not (name == part.short == "is" and isinstance(value, dict))
    }
    others = {name: value for name, value in data.items() if name not in own}
    if isinstance(data, Unfolded):
        others = Unfolded(others, data.routes)
    return {name: value for name, value in data.items() if name in own} | {OTHERS: others}


def _text(value: Any) -> Any:
    if type(value) is not str:
        raise Unlike
    return value


def _scalar(value: Any) -> Any:
    if type(value) is str:
        return value
    if not isinstance(value, (bool, int, float)):
        raise Unlike
    return repr(value)


def _of_text(kind: Text) -> Make:
    if kind.fault or kind.filled:
        return partial(_checked_text, kind)
    return _scalar if kind.scalars or kind.quantity else _text


def _checked_text(kind: Text, value: Any) -> Any:
    text = _scalar(value) if kind.scalars or kind.quantity else _text(value)
    if (kind.filled and not text) or (kind.fault and text is value and kind.fault(text)):
        raise Unlike
    return text


def _whole(value: Any) -> int:
    if isinstance(value, str) and len(value) <= _MOST_DIGITS:
        digits = _DIGITS.fullmatch(value)
        value = int(digits[1]) if digits else value
    if isinstance(value, int) or (isinstance(value, float) and value.is_integer()):
        return int(value)
    raise Unlike


def _truth(value: Any) -> bool:
    meant = value.lower() if isinstance(value, str) else value
    if isinstance(value, _SCALARS) and meant in _TRUTHS:
        return _TRUTHS[meant]
    raise Unlike


def _optional(make: Make, value: Any) -> Any:
    return None if value is None else make(value)


def _one_of(values: dict[Any, Any], value: Any) -> Any:
    if not isinstance(value, _SCALARS) or value not in values:
        raise Unlike
    return values[value]


def _named(fault: Callable[[Any], Any] | None, make: Make, value: Any) -> Any:
    if not isinstance(value, dict) or (fault and any(map(fault, value))):
        raise Unlike
    found = {name: make(one) for name, one in value.items()}
    return Unfolded(found, value.routes) if isinstance(value, Unfolded) else found


def _several(kind: Several, make: Make, value: Any) -> Any:
    how = kind.how
    if type(value) in how.alone:
        value = [value]
    if not isinstance(value, list) or len(value) < how.least:
        raise Unlike
    if how.most is not None and len(value) > how.most:
        raise Unlike
    return kind.made(list(map(make, value)))


@dataclass(frozen=True, slots=True)
class _Plan:
    """Of mappings with the same keys: their set, what makes each value, and the defaults."""

    given: frozenset[str]
    makers: tuple[tuple[str, Make], ...]
    defaults: tuple[tuple[str, Callable[[], object]], ...]


_MOST_PLANS = 1000
"""Of one class: a file from a stranger may have its keys in any number of orders."""


class _Mapping:
    """Makes parts of one class."""

    def __init__(self, part: type[Part]) -> None:
        self._part = part
        self._plan = lru_cache(_MOST_PLANS)(self._planned)

    def made(self, value: Any) -> Part:
        """A part. Raises `Unlike`."""
        part = self._part
        if isinstance(value, dict) and OTHERS in part.keys:
            value = others_apart(part, value)
        names, values = spelled(part, value)
        plan = self._plan(names)
        made: dict[str, Any] = {"given": plan.given}
        for one, (attribute, make) in zip(values, plan.makers, strict=True):
            made[attribute] = make(one)
        for attribute, default in plan.defaults:
            made[attribute] = default()
        found = object.__new__(part)
        found.__dict__ = made
        return found

    def _planned(self, names: tuple[str, ...]) -> _Plan:
        part, given = self._part, frozenset(names)
        lacks = not part.needed <= given and OTHERS not in given
        if lacks or not given <= part.keys.keys():
            raise Unlike
        keys = [part.keys[name] for name in names]
        makers = tuple((key.attribute, maker(key.kind)) for key in keys)
        missing = part.makers.keys() - {key.attribute for key in keys}
        defaults = tuple((name, make) for name, make in part.makers.items() if name in missing)
        return _Plan(given, makers, defaults)


_mapping: Callable[[Any], _Mapping] = cache(_Mapping)
"""Of a class of parts; kinds that are equal may still have other values, 1 and True."""
_MAKERS: dict[type, Callable[[Any], Make]] = {
    Text: _of_text,
    Truth: lambda kind: _truth,
    Whole: lambda kind: _whole,
    OneOf: lambda kind: partial(_one_of, {value: value for value in kind.values}),
    Optional: lambda kind: partial(_optional, maker(kind.value)),
    Named: lambda kind: partial(_named, kind.name.fault, maker(kind.value)),
    Several: lambda kind: partial(_several, kind, maker(kind.item)),
    type: lambda kind: _mapping(kind).made,
}
