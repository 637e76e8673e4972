"""Assumptions, which are watched from the first period on, read only what has a value then."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.absence import Absence, reported
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0704."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0704", _absences(subsystem, facts), subsystem, facts)


def _absences(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    present = facts.presence(subsystem).in_first_period
    for axiom in subsystem.axioms:
        for reading in facts.readings(subsystem).unguarded(axiom.that, present):
            yield Absence(reading, axiom.place, "", "an assumption", "")
