"""What is read has a value by then (docs/language.md, section 8)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from specc.analysis import Facts, Machine
from specc.analysis.definite_assignment import InputRead, Need
from specc.analysis.path_conditions import Evaluation, evaluations
from specc.analysis.reads import text_of
from specc.diagnostics import Diagnostic, Related
from specc.lang import show
from specc.model.fsm import Axiom, Condition, Function
from specc.model.system import Memory, Subsystem
from specc.model.types import OptionalOf
from specc.proof import InputName
from specc.source import Place

# An input that is read where it may have no value, and the finding about it.


_CODES = {Function: "E0701", Condition: "E0702", Memory: "E0703", Axiom: "E0704"}


@dataclass(frozen=True, slots=True)
class Absence:
    """An input that is read by a part of a subsystem where it may have no value."""

    reading: InputRead
    use: Evaluation

    @property
    def code(self) -> str:
        """Of the finding."""
        return _CODES[type(self.use.owner)]

    @property
    def state(self) -> str:
        """The state in which it happens; empty for a period of its own."""
        return self.use.state.name if self.use.state else ""

    @property
    def where(self) -> str:
        """When it happens, in words."""
        if self.state:
            return f"in state `{self.state}`"
        return f"in the {'first' if isinstance(self.use.owner, Memory) else 'second'} period"

    @property
    def what(self) -> str:
        """The part in words."""
        owner = self.use.owner
        return "an assumption" if isinstance(owner, Axiom) else _named(owner)

    @property
    def place(self) -> Place:
        """Where the input is read, in the text of a let or of the part."""
        let = self.reading.let
        text = text_of(let) if let else self.use.text
        return text.place(self.reading.input)


def _named(owner: Function | Condition | Memory) -> str:
    kind = "memory element" if isinstance(owner, Memory) else type(owner).__name__.lower()
    return f"{kind} `{owner.name}`"


def inputs_present(facts: Facts) -> Iterator[Diagnostic]:
    """E0701 to E0704, once for each place that reads without a value, about the first state."""
    for machine in facts.consistent_machines:
        yield from machine.results_of(_without_input)


def _without_input(machine: Machine) -> Iterator[Diagnostic]:
    told: set[tuple[str, Place]] = set()
    for absence in absences(machine):
        if (absence.code, absence.place) not in told:
            told.add((absence.code, absence.place))
            yield _absent(absence, machine)


def _remainders(machine: Machine) -> Callable[[Evaluation], bool]:
    """Whether a use is that of `otherwise`, which asks what the other rows ask."""
    rows = machine.subsystem.transitions
    known = {id(row.condition) for row in rows if row.remainder}
    return lambda use: id(use.owner) in known


def absences(machine: Machine) -> Iterator[Absence]:
    """Inputs that a subsystem reads although they may have no value.

    What `otherwise` reads, the other rows read as well.
    """
    is_remainder = _remainders(machine)
    found = list(_absences(machine))
    asked = {(a.reading.input.key, a.state) for a in found if not is_remainder(a.use)}
    for absence in found:
        if not (is_remainder(absence.use) and (absence.reading.input.key, absence.state) in asked):
            yield absence


def _absences(machine: Machine) -> Iterator[Absence]:
    presence = machine.presence
    if presence.is_sure:
        return
    known: dict[tuple[int, frozenset[InputName]], list[InputRead]] = {}
    for use in evaluations(machine.subsystem, machine.subsystem.transitions):
        key = id(use.text.expr), presence.at(use)
        if key not in known:
            known[key] = list(presence.unguarded(use.text.expr, key[1]))
        yield from (Absence(reading, use) for reading in known[key])


def _absent(absence: Absence, machine: Machine) -> Diagnostic:
    peer, element = absence.reading.input.key
    name = f"x.{peer}.{element}"
    related = []
    if absence.reading.let is not None:
        related.append(Related(absence.use.text.part, f"{absence.what} refers to it"))
    port = machine.subsystem.port("x", peer)
    declared = port.element(element) if port else None
    if declared is not None:
        related.append(Related(declared.place, "has no initial value"))
    return Diagnostic(
        absence.code,
        f"`{name}` may have no value {absence.where}, where {absence.what} reads it",
        absence.place,
        _why(absence, machine),
        tuple(related),
        _way_out(name, absence.state, machine.subsystem),
    )


def _why(absence: Absence, machine: Machine) -> str:
    if isinstance(absence.use.owner, Memory):
        return "nothing has been sent yet"
    if isinstance(absence.use.owner, Axiom):
        return "possibly nothing has been sent by then"
    way = machine.presence.path_without(absence.state, absence.reading.input.key)
    if len(way) == 1:
        return f"possibly nothing has been sent when the system starts in `{way[0]}`"
    return f"on the path {' -> '.join(way)} no row asks whether it has arrived"


def _way_out(name: str, state: str, subsystem: Subsystem) -> str:
    others = f"ask `present({name})` first, or give the element an `init`"
    if not state or state == subsystem.initial_state:
        return others
    return f"enter `{state}` only by rows whose condition implies `fresh({name})`, {others}"


# What may be None or empty is tested before its value or an item is used.


def values_there(facts: Facts) -> Iterator[Diagnostic]:
    """E0705, once for each place, about the first state."""
    for machine in facts.machines:
        if machine.has_known_conditions and machine.present_values.needed:
            yield from machine.results_of(_missing)


def _missing(machine: Machine) -> Iterator[Diagnostic]:
    values, told = machine.present_values, set[object]()
    is_remainder = _remainders(machine)
    every = evaluations(machine.subsystem, (step.row for step in machine.edges))
    for use in sorted(every, key=is_remainder):
        for need in values.lacking(use):
            asked = need.fact, use.state and use.state.name
            if is_remainder(use) and asked in told:
                continue
            told.add(asked)
            text = text_of(need.let) if need.let else use.text
            place = text.place(need.sure)
            if place not in told:
                told.add(place)
                yield _without_value(need, use, place, machine)


def _without_value(need: Need, use: Evaluation, place: Place, machine: Machine) -> Diagnostic:
    text = show(need.sure.value)
    optional = isinstance(need.sure.value.type, OptionalOf)
    lacking = "may be None" if optional else "may be empty"
    where = f" in state `{use.state.name}`" if use.state else ""
    what = _numbered(use.owner, machine) if isinstance(use.owner, Axiom) else _named(use.owner)
    related: tuple[Related, ...] = ()
    if need.let is not None:
        related = (Related(use.text.part, f"{what} refers to it{where}"),)
    test = show(need.fact) if optional else f"len({text}) > 0"
    enter = ""
    if use.state and machine.present_values.entry_tests_suffice(need.fact, use):
        enter = f"enter `{use.state.name}` only by rows whose conditions imply `{test}`, or "
    return Diagnostic(
        "E0705",
        f"`{text}` {lacking}{where}, where {what} needs a value",
        place,
        "",
        related,
        f"{enter}write `... if {test} else ...`",
    )


def _numbered(axiom: Axiom, machine: Machine) -> str:
    return f"assumption {machine.subsystem.axioms.index(axiom) + 1}"
