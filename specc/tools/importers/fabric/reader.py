"""The XML of FABRIC read into definitions."""

from __future__ import annotations

import os
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeVar

from specc.model.expr import FALSE, BoundVariable, Expr
from specc.tools.importers.import_notes import Notes
from specc.tools.importers.logic import LogicError, atoms, join, parse_logic
from specc.tools.importers.markup import XmlElement

# A FABRIC subsystem definition as it is written: `<subsystem_definition>` read into records.


OK, IN_ERROR = "CURRENT_BEHAVIOR_OK", "IN_ERROR"


@dataclass(frozen=True, slots=True)
class Buffer:
    """A buffer of the subsystem; `side` is `top` or `bottom`."""

    alias: str
    type: str
    side: str
    is_input: bool
    element: XmlElement


@dataclass(frozen=True, slots=True)
class Behaviour:
    """What runs in a state; conditions are over predicates."""

    name: str
    stop: Expr
    error: Expr
    components: tuple[str, ...]
    element: XmlElement


@dataclass(frozen=True, slots=True)
class NextState:
    """A `<next_state>`."""

    target: str
    condition: Expr
    element: XmlElement


@dataclass(frozen=True, slots=True)
class FabricState:
    """All behaviours of a state run together; a condition of any of them ends it."""

    name: str
    behaviours: tuple[str, ...]
    arcs: tuple[NextState, ...]
    period_s: Fraction | None
    element: XmlElement


@dataclass(frozen=True, slots=True)
class FabricSubsystem:
    """One subsystem; its name is not in the file, so it comes from the path."""

    name: str
    buffers: tuple[Buffer, ...]
    predicates: tuple[str, ...]
    behaviours: dict[str, Behaviour]
    states: tuple[FabricState, ...]
    initial: str
    period_s: Fraction | None
    root: XmlElement

    def buffer(self, alias: str) -> Buffer | None:
        """The buffer of an alias."""
        return next((b for b in self.buffers if b.alias == alias), None)

    def stop(self, state: FabricState) -> Expr:
        """When a state is left without an error: FABRIC asks any of its behaviours."""
        return join("or", (self.behaviours[b].stop for b in state.behaviours))

    def error(self, state: FabricState) -> Expr:
        """When a state is left in error."""
        return join("or", (self.behaviours[b].error for b in state.behaviours))


# From the XML tree of a subsystem definition to its records.


_Named = TypeVar("_Named")


def read_definition(root: XmlElement, notes: Notes) -> FabricSubsystem | None:
    """The subsystem that a document defines; None, with errors in `notes`, if it is not whole."""
    root.seen = True
    if root.tag != "subsystem_definition":
        message = f"the root is <{root.tag}>, not <subsystem_definition>"
        notes.error("E0803", message, root.place, "is this a subsystem definition of FABRIC?")
        return None
    return _SubsystemReader(notes, root).read()


def name_of(path: str) -> str:
    """The name of a subsystem: its file's, or its package's if the file is `subsystem.xml`."""
    folder, file = os.path.split(os.path.abspath(path))
    stem = os.path.splitext(file)[0]
    if stem != "subsystem":
        return stem
    folder, package = os.path.split(folder)
    return os.path.basename(folder) if package == "spec" else package


@dataclass(eq=False, slots=True)
class _SubsystemReader:
    notes: Notes
    root: XmlElement

    def read(self) -> FabricSubsystem | None:
        before = len(self.notes.diagnostics)
        buffers = self._buffers()
        self._buffer_groups({b.alias for b in buffers if b.is_input})
        predicates = self._predicates()
        behaviours = self._behaviours(frozenset(predicates))
        states, initial = self._states(frozenset(predicates), behaviours)
        period = self._trigger_methods(buffers)
        if any(d.severity == "error" for d in self.notes.diagnostics[before:]):
            return None
        name = name_of(self.root.path)
        return FabricSubsystem(
            name, buffers, predicates, behaviours, states, initial, period, self.root
        )

    def _buffers(self) -> tuple[Buffer, ...]:
        section = self._section(self.root, "buffers")
        found: dict[str, Buffer] = {}
        for element in section.all("in", "out") if section else ():
            alias = self._name(element, "alias")
            message, side = (
                self.notes.need(element, "type"),
                self.notes.need(element, "side").lower(),
            )
            if side not in ("top", "bottom", ""):
                text = f"`{side}` is not a side"
                place = element.value_place("side")
                self.notes.error("E0804", text, place, "the sides are `top` and `bottom`")
            if message and not all(part.isidentifier() for part in _split_type(message)):
                text, place = f"`{message}` is not a type", element.value_place("type")
                self.notes.error("E0804", text, place, "write `package::Message`")
            buffer = Buffer(alias, message, side, element.tag == "in", element)
            self._keep(found, alias, buffer, f"buffer `{alias}`", element)
        return tuple(found.values())

    def _keep(
        self, found: dict[str, _Named], name: str, thing: _Named, what: str, element: XmlElement
    ) -> None:
        """Take note of a thing, if it is the first of its name; a second one is reported."""
        if name in found:
            self._twice(what, element)
        elif name:
            found[name] = thing

    def _buffer_groups(self, inputs: set[str]) -> None:
        """Groups say what data a state waits for; a subsystem of specc never waits for data."""
        section = self._section(self.root, "buffer_groups", needed=False)
        for group in section.all("buffer_group") if section else ():
            for member in group.children:
                name = member.attributes.get("name", "")
                if member.tag in ("obligatory", "optional") and name not in inputs:
                    self._unknown("input buffer", name, member, "name")
        if section is not None:
            section.seen = False

    def _predicates(self) -> tuple[str, ...]:
        section = self._section(self.root, "predicates")
        found: dict[str, XmlElement] = {}
        for element in section.all("predicate") if section else ():
            name = self._name(element)
            self._keep(found, name, element, f"predicate `{name}`", element)
        return tuple(found)

    def _behaviours(self, predicates: frozenset[str]) -> dict[str, Behaviour]:
        section = self._section(self.root, "behaviors")
        found: dict[str, Behaviour] = {}
        for element in section.all("behavior") if section else ():
            name = self._name(element)
            components = tuple(
                self.notes.need(item, "name") for item in element.all("running_component")
            )
            stop = self._condition(element, "stop_cond", predicates | {OK})
            error = self._condition(element, "err_cond", predicates | {OK})
            behaviour = Behaviour(name, stop, error, components, element)
            self._keep(found, name, behaviour, f"behavior `{name}`", element)
        return found

    def _states(
        self, predicates: frozenset[str], behaviours: dict[str, Behaviour]
    ) -> tuple[tuple[FabricState, ...], str]:
        section = self._section(self.root, "states")
        if section is None:
            return (), ""
        initial = self.notes.need(section, "initial")
        found: dict[str, FabricState] = {}
        for element in section.all("state"):
            state = self._state(element, predicates, behaviours)
            self._keep(found, state.name, state, f"state `{state.name}`", element)
        if initial and initial not in found:
            self._unknown("state", initial, section, "initial")
        for state in found.values():
            for arc in state.arcs:
                if arc.target and arc.target not in found:
                    self._unknown("state", arc.target, arc.element, "name")
        return tuple(found.values()), initial

    def _state(
        self, element: XmlElement, predicates: frozenset[str], behaviours: dict[str, Behaviour]
    ) -> FabricState:
        name = self._name(element)
        running = []
        for item in element.all("behavior"):
            behaviour = self.notes.need(item, "name")
            if behaviour and behaviour not in behaviours:
                self._unknown("behavior", behaviour, item, "name")
            running.append(behaviour)
        if not running:
            message = f"state `{name}` needs an element <behavior>"
            self.notes.error("E0804", message, element.place, 'write `<behavior name="..."/>`')
        arcs = tuple(
            NextState(
                self.notes.need(item, "name"),
                self._condition(item, "init_cond", predicates | {OK, IN_ERROR}),
                item,
            )
            for item in element.all("next_state")
        )
        period = None
        for group in element.all("buffer_group"):
            period = self._seconds(group, "min_period") or period
        return FabricState(name, tuple(dict.fromkeys(running)), arcs, period, element)

    def _condition(self, element: XmlElement, attribute: str, known: frozenset[str]) -> Expr:
        if not self.notes.need(element, attribute):
            return FALSE
        try:
            logic = parse_logic(element.attributes[attribute])
        except LogicError as error:
            place = element.value_place(attribute, error.start, error.end)
            help = "conditions join predicates by `and`, `or`, `not` and brackets"
            self.notes.error("E0807", error.message, place, help)
            return FALSE
        for atom in atoms(logic):
            if atom.name not in known:
                self._unknown_predicate(atom, element, attribute)
        return logic

    def _unknown_predicate(self, atom: BoundVariable, element: XmlElement, attribute: str) -> None:
        place = element.value_place(attribute, *atom.span)
        message = f"there is no predicate `{atom.name}`"
        help = "declare the predicate, or correct the name"
        if atom.name == IN_ERROR:
            message = f"`{IN_ERROR}` is known only in `init_cond`"
            help = (
                "conditions of a behavior are evaluated before it is known whether "
                "it ended in error"
            )
        self.notes.error("E0805", message, place, help)

    def _trigger_methods(self, buffers: tuple[Buffer, ...]) -> Fraction | None:
        """The older form of the format: one period for all states, or triggers by data."""
        section = self._section(self.root, "trigger_methods", needed=False)
        if section is None:
            return None
        aliases = {b.alias for b in buffers if b.is_input}
        for element in section.all("new_data_on_buffer", "no_data_on_buffer"):
            name = self.notes.need(element, "name")
            if name and name not in aliases:
                self._unknown("input buffer", name, element, "name")
            element.seen = False
        period = None
        for element in section.all("interval"):
            period = self._seconds(element, "min")
        for element in section.all("period"):
            period = self._seconds(element, "value")
        return period

    # What is missing, twice there or not known is reported.

    def _name(self, element: XmlElement, attribute: str = "name") -> str:
        """The value of an attribute that names something; FABRIC makes C++ of it."""
        value = self.notes.need(element, attribute)
        if value and not (value.isidentifier() and value.isascii()):
            message, place = f"`{value}` is not a name", element.value_place(attribute)
            self.notes.error("E0804", message, place, "write letters, digits and underscores")
        return value

    def _section(self, root: XmlElement, tag: str, *, needed: bool = True) -> XmlElement | None:
        """The only child of a tag; a missing or a second one is an error."""
        found = root.all(tag)
        if not found and needed:
            message = f"<{root.tag}> needs an element <{tag}>"
            self.notes.error("E0804", message, root.place, f"write `<{tag}> ... </{tag}>`")
        for second in found[1:]:
            self._twice(f"<{tag}>", second)
        return found[0] if found else None

    def _twice(self, what: str, element: XmlElement) -> None:
        """Report the second of two things that must be one."""
        place = element.value_place("name") if "name" in element.attributes else element.place
        self.notes.error("E0806", f"{what} is there twice", place, "delete or rename one of them")

    def _unknown(self, what: str, name: str, element: XmlElement, attribute: str) -> None:
        """Report a name that nothing has."""
        message = f"there is no {what} `{name}`"
        place = element.value_place(attribute)
        self.notes.error("E0805", message, place, f"declare the {what}, or correct the name")

    def _seconds(self, element: XmlElement, attribute: str) -> Fraction | None:
        """A positive time; zero, which FABRIC takes for `at once`, is None."""
        text = self.notes.need(element, attribute)
        try:
            # Through a float: the Fraction of `1e999999999` is computed digit by digit.
            rough = float(text)
            if not 0.0 <= rough <= 3600.0 or 0.0 < rough < 1e-7:
                raise ValueError
            value = Fraction(str(rough))
        except ValueError:
            if text:
                message = f"`{text}` is not a time in seconds"
                place = element.value_place(attribute)
                self.notes.error("E0804", message, place, "write a number such as 0.001")
            return None
        return value or None


def _split_type(message: str) -> list[str]:
    return message.split("::") if message.count("::") == 1 else [""]
