"""Every named part of a subsystem is used somewhere in it."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.parts import Parts
from specc.model.system import System

MOST = 8
"""Parts that are shown with one that is not used."""


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0611; what only unused parts use is shown with them."""
    task = system.task
    for subsystem in facts.whole_subsystems:
        watched = task.watch if task and task.subsystem == subsystem.qualified_name else ()
        parts = Parts(subsystem, watched)
        for label in parts.unused():
            yield Diagnostic(
                "W0611",
                f"{_quoted(label)} is not used",
                parts.known[label].place,
                related=tuple(
                    Related(parts.known[other].place, f"and so is {_quoted(other)}")
                    for other in parts.behind(label)[:MOST]
                ),
                help="use or delete it",
            )


def _quoted(label: str) -> str:
    kind, _, name = label.rpartition(" ")
    return f"{kind} `{name}`"
