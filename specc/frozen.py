"""Classes of values, such as `dataclass(frozen=True, slots=True)` makes, at a quarter of the cost.

All commands import some 200 of them. mypy, not the running program, keeps them from being changed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import Field, dataclass, field, fields
from operator import attrgetter
from typing import Any, TypeVar, dataclass_transform

T = TypeVar("T")


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(cls: type[T]) -> type[T]:
    """A class of values that are made of their fields, compared and hashed by them."""
    made: Any = dataclass(eq=False, repr=False, slots=True)(cls)
    compared = [part for part in fields(made) if part.compare]
    equals = _key(compared)
    hashed = _key([part for part in compared if part.hash is not False])

    def equal(self: Any, other: object) -> Any:
        return equals(self) == equals(other) if isinstance(other, made) else NotImplemented

    methods = {"__eq__": equal, "__hash__": lambda self: hash(hashed(self)), "__repr__": _shown}
    for name, method in methods.items():
        if name not in cls.__dict__:
            setattr(made, name, method)
    return made  # type: ignore[no-any-return]  # the class itself, with slots


def _key(parts: Sequence[Field[Any]]) -> Callable[[Any], object]:
    """What two values have alike if these fields are."""
    return attrgetter("__class__", *(part.name for part in parts))


def _shown(self: Any) -> str:
    parts = (f"{part.name}={getattr(self, part.name)!r}" for part in fields(self) if part.repr)
    return f"{type(self).__qualname__}({', '.join(parts)})"
