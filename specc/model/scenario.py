"""Scenarios: what a run of a system is put through, and what is expected of it."""

from __future__ import annotations

from dataclasses import dataclass

from specc.model.requirement import Requirement
from specc.model.task import Disturbance, Draw
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Scenario:
    """Runs of a system over some seeds, each with other constants, another scene and disturbances.

    A scenario changes nothing else. `success` is the least share of its runs that pass, as it is
    written: so many of so many, `None` for all of them.
    """

    name: str
    because: str
    settings: tuple[tuple[str, str], ...]
    """Names of constants and parameters, with the texts of their values."""
    starts: tuple[Draw, ...]
    disturbances: tuple[Disturbance, ...]
    """Those of its own, what is done at the panel last."""
    is_undisturbed: bool
    """Whether the disturbances of the task do not happen."""
    seeds: tuple[int, ...]
    duration_s: float | None
    cycles: int | None
    expect: tuple[Requirement, ...]
    success: tuple[int, int] | None
    place: Place

    @property
    def formulas(self) -> tuple[Requirement, ...]:
        """What is expected, and what its disturbances wait for."""
        return (*self.expect, *filter(None, (each.when for each in self.disturbances)))
