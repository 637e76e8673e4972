"""What is read has a value by then (docs/language.md, section 8)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from specc.analysis.facts import Facts
from specc.analysis.guards import asked
from specc.analysis.presence import Reading
from specc.analysis.words import text_place
from specc.diagnostics import Diagnostic, Related
from specc.frozen import frozen
from specc.model.fsm import Condition, State
from specc.model.system import Subsystem, System
from specc.proof import InputName
from specc.source import Place

# An input that is read where it may have no value, and the finding about it.


FIRST_PERIOD = "the first period"


@frozen
class Absence:
    """A reading by a part of a subsystem, whose text is at `key` of its place."""

    reading: Reading
    part: Place
    key: str
    what: str
    """The part in words."""
    state: str
    """The state in which it happens; empty for a period of its own."""
    period: str = FIRST_PERIOD
    """Without a state: the first one in which it happens."""

    @property
    def where(self) -> str:
        """When it happens, in words."""
        return f"in state `{self.state}`" if self.state else f"in {self.period}"

    @property
    def place(self) -> Place:
        """Where the input is read, in the text of a let or of the part."""
        let = self.reading.let
        if let is not None:
            return text_place(let.place, "is", self.reading.input)
        if not self.key:
            start, end = self.reading.input.span
            return replace(self.part, start=start, end=end)
        return text_place(self.part, self.key, self.reading.input)


def reported(
    code: str, absences: Iterable[Absence], subsystem: Subsystem, facts: Facts
) -> Iterator[Diagnostic]:
    """One finding for each place that reads without a value, about the first such state."""
    told: set[Place] = set()
    for absence in absences:
        if absence.place not in told:
            told.add(absence.place)
            yield _finding(code, absence, subsystem, facts)


def _finding(code: str, absence: Absence, subsystem: Subsystem, facts: Facts) -> Diagnostic:
    peer, element = absence.reading.name
    name = f"x.{peer}.{element}"
    related = []
    if absence.reading.let is not None:
        related.append(Related(absence.part, f"{absence.what} refers to it"))
    port = subsystem.port("x", peer)
    declared = port.element(element) if port else None
    if declared is not None:
        related.append(Related(declared.place, "has no initial value"))
    return Diagnostic(
        code,
        f"`{name}` may have no value {absence.where}, where {absence.what} reads it",
        absence.place,
        _why(absence, subsystem, facts),
        tuple(related),
        _way_out(name, absence.state, subsystem),
    )


def _why(absence: Absence, subsystem: Subsystem, facts: Facts) -> str:
    if not absence.state:
        first = absence.period == FIRST_PERIOD
        return "nothing has been sent yet" if first else "possibly nothing has been sent by then"
    way = facts.presence(subsystem).way_without(absence.state, absence.reading.name)
    if len(way) == 1:
        return f"possibly nothing has been sent when the system starts in `{way[0]}`"
    return f"on the path {' -> '.join(way)} no row asks whether it has arrived"


def _way_out(name: str, state: str, subsystem: Subsystem) -> str:
    others = f"ask `present({name})` first, or give the element an `init`"
    if not state or state == subsystem.initial_state:
        return others
    return f"enter `{state}` only by rows whose condition implies `fresh({name})`, {others}"


# Functions read only inputs that surely have a value in every state that executes them.


def presence_in_functions(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0701."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0701", absences_in_functions(subsystem, facts), subsystem, facts)


def absences_in_functions(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that functions read although they may have no value."""
    presence, readings = facts.presence(subsystem), facts.readings(subsystem)
    for state in subsystem.states:
        present = presence.in_functions[state.name]
        for function in state.behaviour.functions:
            for assignment in function.assignments:
                for reading in readings.unguarded(assignment.value, present):
                    name = f"function `{function.name}`"
                    yield Absence(reading, assignment.place, "is", name, state.name)


# Conditions read only inputs that surely have a value when they are asked.


Asked = tuple[Condition, frozenset[InputName]]


def presence_in_conditions(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0702."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0702", absences_in_conditions(subsystem, facts), subsystem, facts)


def absences_in_conditions(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that conditions read although they may have no value."""
    readings = facts.readings(subsystem)
    known: dict[object, list[Reading]] = {}
    for state in subsystem.states:
        for condition, present in _asked(subsystem, state, facts):
            key = id(condition.when), present
            if key not in known:
                known[key] = list(readings.unguarded(condition.when, present))
            for reading in known[key]:
                name = f"condition `{condition.name}`"
                yield Absence(reading, condition.place, "when", name, state.name)


def _asked(subsystem: Subsystem, state: State, facts: Facts) -> Iterator[Asked]:
    """The conditions that may end a state, each with the inputs present when it is asked."""
    presence, readings = facts.presence(subsystem), facts.readings(subsystem)
    for tests, conditions in asked(state, facts.rows(subsystem, state.name)):
        present = presence.in_conditions(state.name)
        for test, holds in tests:
            present = readings.behind(present, test, holds)
        yield from ((condition, present) for condition in conditions)


# Initial values of memory come from what has a value in the first period.


def presence_in_memory(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0703."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0703", absences_in_memory(subsystem, facts), subsystem, facts)


def absences_in_memory(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that initial values of memory read although they may have no value."""
    present = facts.presence(subsystem).in_first_period
    for memory in subsystem.memory:
        for reading in facts.readings(subsystem).unguarded(memory.init, present):
            yield Absence(reading, memory.place, "init", f"memory element `{memory.name}`", "")


# Assumptions, which are watched from the second period on, read only what has a value then.


def presence_in_axioms(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0704."""
    for subsystem in facts.consistent_subsystems:
        yield from reported("E0704", absences_in_axioms(subsystem, facts), subsystem, facts)


def absences_in_axioms(subsystem: Subsystem, facts: Facts) -> Iterator[Absence]:
    """Inputs that assumptions read although they may have no value."""
    present = facts.presence(subsystem).in_later_periods
    for axiom in subsystem.axioms:
        for reading in facts.readings(subsystem).unguarded(axiom.that, present):
            yield Absence(reading, axiom.place, "", "an assumption", "", "the second period")


CHECKS = (presence_in_functions, presence_in_conditions, presence_in_memory, presence_in_axioms)
