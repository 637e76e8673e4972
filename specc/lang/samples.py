"""Values that Python has no class for, how values are written, and when they are alike.

They are those of `specc.lang.evaluate`: a vector is a tuple, a pose a tuple of rows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

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


class Gone:
    """An image, or a value that only operators look into, of which nothing is recorded."""


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
