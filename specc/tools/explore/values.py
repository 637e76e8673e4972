"""Numbers for the values that are kept, so that configurations are small and quickly compared."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from specc.model import expr as m
from specc.tools.explore.partial import SOME, Known, Value, is_literal, is_some

MOST_VALUES = 32
"""Of one element; where more are computed, later ones are unknown."""

UNKNOWN, ABSENT = 0, 1
"""Numbers of what is not a value; the others number literals, and SOME."""


@dataclass(slots=True)
class Numbers:
    """Numbers things in the order in which they come."""

    known: dict[Any, int] = field(default_factory=dict)
    things: list[Any] = field(default_factory=list)

    def of(self, thing: Any) -> int:
        """The number of a thing."""
        number = self.known.get(thing)
        if number is None:
            number = self.known[thing] = len(self.things)
            self.things.append(thing)
        return number


class Values:
    """Numbers of the values that are kept, shared by all machines."""

    def __init__(self) -> None:
        self._numbers = Numbers()
        for reserved in ("unknown", "absent", SOME):
            self._numbers.of(reserved)
        self._seen: dict[str, set[int]] = {}
        self.widened: set[str] = set()

    @property
    def widened_names(self) -> tuple[str, ...]:
        """The targets with too many values: subsystem and memory, output or input."""
        return tuple(sorted(str(target) for target in self.widened))

    def of(self, target: str, expr: m.Expr, known: Known) -> int:
        """The number of what is assigned to a target."""
        if not is_literal(expr):
            return self._numbers.of(SOME) if is_some(expr, known) else UNKNOWN
        number = self._numbers.of(expr)
        seen = self._seen.setdefault(target, set())
        if number not in seen and len(seen) >= MOST_VALUES:
            self.widened.add(target)
            return UNKNOWN if isinstance(expr, m.Nothing) else self._numbers.of(SOME)
        seen.add(number)
        return number

    def value(self, number: int) -> Value | None:
        """What a number stands for; None if it is unknown or absent."""
        return None if number in (UNKNOWN, ABSENT) else self._numbers.things[number]
