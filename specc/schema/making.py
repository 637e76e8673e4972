"""Parts made of data that have the shape of a file; where they do not, `shape` says what is wrong.

What makes values of a kind is put together once for each kind. It knows no places, since it tells
nothing: it gives up at the first value that is not right.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache, partial
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


def in_full(part: type[Part], value: Any) -> Any:
    """The mapping that a short form stands for; any other value as it is."""
    if part.short and isinstance(value, _SCALARS):
        return {part.short: value}
    if part.row and isinstance(value, list) and len(value) == len(part.row):
        return dict(zip(part.row, value, strict=True))
    return value


def others_apart(part: type[Part], data: dict[str, Any]) -> dict[str, Any]:
    """The parts with names that people choose. With a mapping, `is` is such a name, not a key."""
    known = part.keys.keys() - {OTHERS}
    if known.isdisjoint(data):
        return {OTHERS: data}
    own = {
        name
        for name, value in data.items()
        if name in known and not (name == part.short == "is" and isinstance(value, dict))
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


class _Mapping:
    """Makes parts of one class."""

    def __init__(self, part: type[Part]) -> None:
        self._part = part
        self._makers: dict[str, tuple[str, Make]] = {}

    def made(self, value: Any) -> Part:
        """A part. Raises `Unlike`."""
        part = self._part
        data = value if isinstance(value, dict) else in_full(part, value)
        if not isinstance(data, dict):
            raise Unlike
        if OTHERS in part.keys:
            data = others_apart(part, data)
        given = frozenset(data)
        if not part.needed <= given and OTHERS not in given:
            raise Unlike
        return self._filled(data, given)

    def _filled(self, data: dict[str, Any], given: frozenset[str]) -> Part:
        makers = self._makers
        values: dict[str, Any] = {"given": given}
        for name, one in data.items():
            attribute, make = makers.get(name) or self._known(name)
            values[attribute] = make(one)
        for attribute, default in self._part.makers.items():
            if attribute not in values:
                values[attribute] = default()
        found = object.__new__(self._part)
        found.__dict__ = values
        return found

    def _known(self, name: str) -> tuple[str, Make]:
        key = self._part.keys.get(name)
        if key is None:
            raise Unlike
        self._makers[name] = key.attribute, maker(key.kind)
        return self._makers[name]


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
