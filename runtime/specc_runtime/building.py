"""What makes a record of values that are known to be right, without executing code of its class."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Set
from dataclasses import fields, is_dataclass
from functools import partial
from typing import Any


def builder(kind: Any, names: Set[str]) -> tuple[tuple[str, ...], Callable[[Iterable[Any]], Any]]:
    """The fields of a record in the order of its class, and what makes one of their values.

    Raises TypeError for a class whose values can be changed, or that has other fields.
    """
    owner: Any = kind
    if isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields"):
        known: tuple[str, ...] = kind._fields
        build: Callable[[Iterable[Any]], Any] = partial(tuple.__new__, kind)
    elif is_dataclass(kind) and owner.__dataclass_params__.frozen:
        known = tuple(part.name for part in fields(kind))
        build = partial(_with_fields, owner, known)
    else:
        raise TypeError(
            f"{named(kind)} of a record has to be a frozen dataclass or a NamedTuple, "
            "so that its values do not change"
        )
    if missing := sorted(names - set(known)):
        raise TypeError(f"{named(kind)} has no field {', '.join(missing)}")
    if others := [name for name in known if name not in names]:
        raise TypeError(
            f"{named(kind)} has fields that its record does not declare: {', '.join(others)}; "
            "declare them, so that they are checked as well"
        )
    return known, build


def named(kind: Any) -> str:
    """A class, or what should be one, in words."""
    return (
        f"class {kind.__name__}" if isinstance(kind, type) else f"{kind!r}, which is not a class,"
    )


def _with_fields(kind: type, names: tuple[str, ...], values: Iterable[Any]) -> Any:
    made: Any = object.__new__(kind)
    for name, value in zip(names, values, strict=True):
        object.__setattr__(made, name, value)
    return made
