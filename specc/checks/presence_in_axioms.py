"""Assumptions, which are watched from the second period on, read only what has a value then."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.absence import Absence, reported
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0704."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0704", absences(subsystem, facts), subsystem, facts)


def absences(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that assumptions read although they may have no value."""
    present = facts.presence(subsystem).in_later_periods
    for axiom in subsystem.axioms:
        for reading in facts.readings(subsystem).unguarded(axiom.that, present):
            yield Absence(reading, axiom.place, "", "an assumption", "", "the second period")
