"""A declared condition holds in some situation and fails in another."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0613."""
    for subsystem in facts.whole_subsystems:
        for condition in subsystem.conditions:
            settled = facts.settled(subsystem, condition)
            if settled is not None:
                word = "always" if settled else "never"
                yield Diagnostic(
                    "W0613",
                    f"{condition.kind} condition `{condition.name}` {word} holds",
                    condition.place,
                    help=f"say `{word}` where it is used, or mend the condition",
                )
