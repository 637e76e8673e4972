"""What a run needs that a specification can otherwise do without: a plant, and a task to count."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from specc.checks.devices_simulated import without_plant
from specc.diagnostics import Diagnostic
from specc.source import Place

if TYPE_CHECKING:
    from specc.pipeline import Result


def missing(result: Result, path: str, *, counts: bool) -> Iterator[Diagnostic]:
    """O0501 without a plant behind devices, O0503 where cycles are to be counted without a task."""
    system, place = result.system, Place(path, ("system",), "key")
    if system is None:
        return
    if system.plant is None:
        yield from without_plant(system, place)
    if counts and system.task is None:
        yield Diagnostic(
            "O0503",
            "nothing says what a run counts: there is no task",
            place,
            help="add `task:` with the transition that ends a cycle, or say `--duration`",
        )
