"""Communication buffers: connections compiled to setters, outputs read by one getter per state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, is_dataclass
from operator import attrgetter
from typing import Any

import numpy as np

Put = Callable[[Any], None]
"""Makes a value visible to one reader."""

Sent = tuple[tuple[str, Any], ...]
"""Names and values of output elements."""

FRESH, PRESENT = "fresh_", "present_"
AGE, LATE = "age_", "late_"
"""What slots beside those of elements begin with."""
_LEAVES = frozenset((float, int, bool, str, type(None)))


def freeze(value: Any) -> None:
    """Make the arrays of a value read-only, through tuples and records."""
    kind = type(value)
    if kind is np.ndarray:
        value.setflags(write=False)
    elif kind in _LEAVES:
        return
    elif isinstance(value, tuple):
        for item in value:
            freeze(item)
    elif is_dataclass(value):
        for part in fields(value):
            freeze(getattr(value, part.name))


def slots(buffer: object) -> tuple[str, ...]:
    """All names of a buffer, with or without a value, in order of declaration."""
    names = [name for cls in type(buffer).__mro__ for name in getattr(cls, "__slots__", ())]
    return (*names, *getattr(buffer, "__dict__", ()))


def lower_flags(buffer: object) -> Callable[[], None]:
    """Give flags that have no value yet the value False; return what lowers the fresh ones."""
    names = slots(buffer)
    for name in names:
        if name.startswith((FRESH, PRESENT)) and not hasattr(buffer, name):
            setattr(buffer, name, False)
    fresh = tuple(name for name in names if name.startswith(FRESH))

    def clear() -> None:
        for name in fresh:
            setattr(buffer, name, False)

    return clear


def setter(buffer: object, element: str) -> Put:
    """What writes `element` and raises its flags; raises AttributeError if there is none."""
    names = slots(buffer)
    if element not in names:
        raise AttributeError(f"{type(buffer).__qualname__} has no element {element!r}")
    raised = tuple(flag for flag in (FRESH + element, PRESENT + element) if flag in names)

    def put(value: Any) -> None:
        setattr(buffer, element, value)
        for flag in raised:
            setattr(buffer, flag, True)

    return put


def sender(elements: Sequence[str], readers: Sequence[Sequence[Put]]) -> Callable[[Any], Sent]:
    """What sends the named elements of an output buffer to their readers and returns them.

    `readers` has the setters for each element. Values become read-only on the way.
    """
    names = tuple(elements)
    routes = tuple((i, put) for i, puts in enumerate(readers) for put in puts)
    if len(names) < 2:  # attrgetter makes no tuple of one
        return _sender_of_one(names[0], readers[0]) if names else lambda buffer: ()
    get = attrgetter(*names)
    array = np.ndarray

    def send(buffer: Any) -> Sent:
        values = get(buffer)
        for value in values:
            if type(value) is array:  # by far the most frequent kind
                value.setflags(write=False)
            else:
                freeze(value)
        for index, put in routes:
            put(values[index])
        return tuple(zip(names, values, strict=True))

    return send


def _sender_of_one(name: str, readers: Sequence[Put]) -> Callable[[Any], Sent]:
    def send(buffer: Any) -> Sent:
        value = getattr(buffer, name)
        freeze(value)
        for put in readers:
            put(value)
        return ((name, value),)

    return send
