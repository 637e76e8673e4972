"""An input that is read where it may have no value, and the finding about it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from specc.diagnostics import Diagnostic, Related
from specc.facts.facts import Facts
from specc.facts.places import text_place
from specc.facts.reading import Reading
from specc.model.system import Subsystem
from specc.source import Place

FIRST_PERIOD = "the first period"


@dataclass(frozen=True, slots=True)
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
    """One finding for each place that reads in vain, about the first state that does so."""
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
        return "nothing has been sent yet" if first else "nothing need have been sent by then"
    way = facts.presence(subsystem).way_without(absence.state, absence.reading.name)
    if len(way) == 1:
        return f"nothing need have been sent when the system starts in `{way[0]}`"
    return f"on the way {' -> '.join(way)} no row asks whether it has come"


def _way_out(name: str, state: str, subsystem: Subsystem) -> str:
    others = f"ask `present({name})` first, or give the element an `init`"
    if not state or state == subsystem.initial_state:
        return others
    return f"enter `{state}` only by rows whose condition implies `fresh({name})`, {others}"
