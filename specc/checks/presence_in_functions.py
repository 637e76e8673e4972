"""Functions read only inputs that surely have a value in every state that executes them."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.absence import Absence, reported
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0701."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0701", absences(subsystem, facts), subsystem, facts)


def absences(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that functions read although they may have no value."""
    presence, readings = facts.presence(subsystem), facts.readings(subsystem)
    for state in subsystem.states:
        present = presence.in_functions[state.name]
        for function in state.behaviour.functions:
            for assignment in function.assignments:
                for reading in readings.unguarded(assignment.value, present):
                    name = f"function `{function.name}`"
                    yield Absence(reading, assignment.place, "is", name, state.name)
