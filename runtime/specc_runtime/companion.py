"""What goes along with a run and never changes it: progress, video, window."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


class FilmError(Exception):
    """The film of a run is missing, or a part of it."""


@dataclass(frozen=True, slots=True)
class View:
    """A run at one moment. `cycles` and `duration_s` are what was asked for, or None."""

    time_s: float
    states: dict[str, str]
    fulfilled: tuple[bool, ...]
    cycles: int | None
    duration_s: float | None


class Companion(Protocol):
    """Called every `period_s` of simulated time."""

    period_s: float

    def tick(self, view: View) -> None:
        """Take note of the run as it is now."""

    def close(self) -> None:
        """The run is over, one way or another."""
