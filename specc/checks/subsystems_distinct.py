"""The subsystems of an agent have different names; `c` is the control subsystem."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0411."""
    for agent in system.agents:
        first: dict[str, Subsystem] = {}
        for subsystem in agent.subsystems:
            earlier = first.setdefault(subsystem.name, subsystem)
            if earlier is not subsystem:
                yield Diagnostic(
                    "E0411",
                    f"agent `{agent.name}` has two subsystems called `{subsystem.name}`",
                    subsystem.place,
                    related=(Related(earlier.place, "this one has the name already"),),
                    help="choose another name; a real device of that name is listed under `uses:`",
                )
