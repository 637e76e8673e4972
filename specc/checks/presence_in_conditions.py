"""Conditions read only inputs that surely have a value when they are asked."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.absence import Absence, reported
from specc.model.fsm import Condition, State
from specc.model.system import Subsystem, System
from specc.proof import InputName

Asked = tuple[Condition, frozenset[InputName]]


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0702."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0702", absences(subsystem, facts), subsystem, facts)


def absences(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that conditions read although they may have no value."""
    readings = facts.readings(subsystem)
    for state in subsystem.states:
        for condition, present in _asked(subsystem, state, facts):
            for reading in readings.unguarded(condition.when, present):
                name = f"condition `{condition.name}`"
                yield Absence(reading, condition.place, "when", name, state.name)


def _asked(subsystem: Subsystem, state: State, facts: Facts) -> Iterator[Asked]:
    """The conditions that may end a state, each with the inputs present when it is asked.

    The error condition comes first; rows are asked when their cause has occurred.
    """
    presence, readings = facts.presence(subsystem), facts.readings(subsystem)
    error, terminal = state.behaviour.error, state.behaviour.terminal
    present = presence.in_conditions(state.name)
    yield error, present
    failed = readings.close(present | readings.told(error.when, True))
    going = readings.close(present | readings.told(error.when, False))
    yield terminal, going
    ended = readings.close(going | readings.told(terminal.when, True))
    for row in facts.rows(subsystem, state.name):
        yield row.condition, ended if row.cause == "terminal" else failed
