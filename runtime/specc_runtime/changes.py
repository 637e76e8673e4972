"""What is changed in a run from outside, by any thread: it takes effect at base ticks, in turn."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar, cast

PROGRAM, TASK, PAGE, KEYS = "program", "task", "page", "keys"
PARAMETER = "parameter"
"""By whom something is changed; by a parameter, by another node of ROS."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something that takes effect at a base tick."""

    tick: int

    def as_data(self) -> dict[str, Any]:
        """Plain data; there may be very many in a snapshot."""
        return {field: getattr(self, field) for field in self.__dataclass_fields__}


E = TypeVar("E", bound=Event)


class EventQueue(Generic[E]):
    """Events of one kind: those that are asked for, and the `history` of those that took effect."""

    def __init__(self) -> None:
        self.history: list[E] = []
        self._waiting: deque[E] = deque()

    def ask(self, event: E) -> None:
        """Have it take effect at its base tick, or at the next one if that is over."""
        self._waiting.append(event)

    def begin(self, tick: int) -> list[E]:
        """The events that are asked for by this base tick, which are made now."""
        due = []
        for _ in range(len(self._waiting)):
            event = self._waiting.popleft()
            if event.tick > tick:
                self._waiting.append(event)
            else:
                due.append(replace(event, tick=tick))
        self.history += due
        return due


def number_within(
    name: str, value: Any, least: float, greatest: float, unit: str, *, whole: bool
) -> float:
    """A number that `name` may get; raises ValueError for any other value."""
    allowed: tuple[type, ...] = (int,) if whole else (int, float)
    if type(value) is bool or not isinstance(value, allowed):
        what = "a whole number" if whole else "a number"
        raise ValueError(f"{name} is {what}, and not {value!r}")
    exact = cast(float, value)
    try:
        number = float(exact)
    except OverflowError:
        number = math.copysign(math.inf, 1 if exact > 0 else -1)
    if not least <= number <= greatest:
        unit = f" {unit}" if unit else ""
        raise ValueError(
            f"{name} is not {number:g}{unit}: its range is {least:g} to {greatest:g}{unit}"
        )
    return exact if whole else number
