"""What the main file defines for all agents is used by one of them."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.uses import unused
from specc.model.system import System

MOST = 8
"""Definitions that are shown with one that is not used."""


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0240, once there are agents; a library may well define more than one system needs.

    What only unused definitions use is shown with them.
    """
    if not system.subsystems:
        return
    for definition, behind in unused(system):
        related = [
            Related(other.place, f"and so is {other.kind} `{other.name}`")
            for other in behind[:MOST]
        ]
        yield Diagnostic(
            "W0240",
            f"{definition.kind} `{definition.name}` is not used",
            definition.place,
            related=tuple(related),
            help="use or delete it",
        )
