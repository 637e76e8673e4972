"""Initial values of memory come from what has a value in the first period."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.absence import Absence, reported
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0703."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0703", absences(subsystem, facts), subsystem, facts)


def absences(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that initial values of memory read although they may have no value."""
    present = facts.presence(subsystem).in_first_period
    for memory in subsystem.memory:
        for reading in facts.readings(subsystem).unguarded(memory.init, present):
            yield Absence(reading, memory.place, "init", f"memory element `{memory.name}`", "")
