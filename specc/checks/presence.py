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
from specc.model.system import Memory
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
        return "an assumption" if isinstance(owner, Axiom) else _owner_phrase(owner)

    @property
    def place(self) -> Place:
        """Where the input is read, in the text of a let or of the part."""
        let = self.reading.let
        text = text_of(let) if let else self.use.text
        return text.place(self.reading.input)


def _owner_phrase(owner: Function | Condition | Memory) -> str:
    kind = "memory element" if isinstance(owner, Memory) else type(owner).__name__.lower()
    return f"{kind} `{owner.name}`"


def inputs_present(facts: Facts) -> Iterator[Diagnostic]:
    """E0701 to E0704, once for each place that reads without a value, about the first state."""
    for machine in facts.consistent_machines:
        yield from _absence_findings(machine)


def _absence_findings(machine: Machine) -> Iterator[Diagnostic]:
    reported: set[tuple[str, Place]] = set()
    for absence in absences(machine):
        if (absence.code, absence.place) in reported:
            continue
        reported.add((absence.code, absence.place))
        (peer, element), state = absence.reading.input.key, absence.state
        name = f"x.{peer}.{element}"
        related = []
        if absence.reading.let is not None:
            related.append(Related(absence.use.text.part, f"{absence.what} refers to it"))
        port = machine.subsystem.port("x", peer)
        declared = port.element(element) if port else None
        if declared is not None:
            related.append(Related(declared.place, "has no initial value"))
        label = "nothing has been sent yet"
        if isinstance(absence.use.owner, Axiom):
            label = "possibly nothing has been sent by then"
        elif state:
            path = machine.presence.path_without(state, (peer, element))
            label = f"on the path {' -> '.join(path)} no row asks whether it has arrived"
            if len(path) == 1:
                label = f"possibly nothing has been sent when the system starts in `{path[0]}`"
        help = f"ask `present({name})` first, or give the element an `init`"
        if state and state != machine.subsystem.initial_state:
            help = f"enter `{state}` only by rows whose condition implies `fresh({name})`, {help}"
        yield Diagnostic(
            absence.code,
            f"`{name}` may have no value {absence.where}, where {absence.what} reads it",
            absence.place,
            label,
            tuple(related),
            help,
        )


def _remainders(machine: Machine) -> Callable[[Evaluation], bool]:
    """Return a predicate for evaluations of `otherwise`, which reads what the other rows read."""
    rows = machine.subsystem.transitions
    known = {id(row.condition) for row in rows if row.is_otherwise}
    return lambda use: id(use.owner) in known


def absences(machine: Machine) -> Iterator[Absence]:
    """Inputs that a subsystem reads although they may have no value.

    What `otherwise` reads, the other rows read as well.
    """
    presence, is_remainder = machine.presence, _remainders(machine)
    if presence.is_sure:
        return
    known: dict[tuple[int, frozenset[InputName]], list[InputRead]] = {}
    found: list[Absence] = []
    for use in evaluations(machine.subsystem, machine.subsystem.transitions):
        key = id(use.text.expr), presence.at(use)
        if key not in known:
            known[key] = list(presence.unguarded(use.text.expr, key[1]))
        found += [Absence(reading, use) for reading in known[key]]
    read = {(a.reading.input.key, a.state) for a in found if not is_remainder(a.use)}
    for absence in found:
        if not is_remainder(absence.use) or (absence.reading.input.key, absence.state) not in read:
            yield absence


# What may be None or empty is tested before its value or an item is used.


def values_there(facts: Facts) -> Iterator[Diagnostic]:
    """E0705, once for each place, about the first state."""
    for machine in facts.machines:
        if machine.has_known_conditions and machine.present_values.needed:
            yield from _missing_value_findings(machine)


def _missing_value_findings(machine: Machine) -> Iterator[Diagnostic]:
    is_remainder, reported = _remainders(machine), set[object]()
    every = evaluations(machine.subsystem, (edge.row for edge in machine.edges))
    for use in sorted(every, key=is_remainder):
        for need in machine.present_values.lacking(use):
            question = need.fact, use.state and use.state.name
            place = (text_of(need.let) if need.let else use.text).place(need.sure)
            if not (is_remainder(use) and question in reported):
                if place not in reported:
                    yield _missing_value_finding(need, use, place, machine)
                reported |= {question, place}


def _missing_value_finding(
    need: Need, use: Evaluation, place: Place, machine: Machine
) -> Diagnostic:
    text = show(need.sure.value)
    optional = isinstance(need.sure.value.type, OptionalOf)
    lacking = "may be None" if optional else "may be empty"
    where = f" in state `{use.state.name}`" if use.state else ""
    what = (
        f"assumption {machine.subsystem.axioms.index(use.owner) + 1}"
        if isinstance(use.owner, Axiom)
        else _owner_phrase(use.owner)
    )
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
