"""What is to be simulated has a plant behind its devices and a task to count."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.model.system import System
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """O0501 and O0503; a specification with neither plant nor task is not meant to be simulated."""
    if system.plant is None and system.task is not None:
        yield from without_plant(system, system.task.place)
    if system.plant is not None and system.task is None and system.devices:
        yield Diagnostic(
            "O0503",
            "nothing says what a run counts: there is no task",
            system.plant.place,
            help="add `task:` with the transition that ends a cycle",
        )


def without_plant(system: System, place: Place) -> Iterator[Diagnostic]:
    """O0501 at a place, if there are devices."""
    if system.devices:
        names = ", ".join(f"`{device.qualified_name}`" for device in system.devices)
        yield Diagnostic(
            "O0501",
            "there is no plant behind the devices",
            place,
            f"nothing stands behind {names}",
            help="add `plant:` with what makes it, `model` or `python`, and what it binds",
        )
