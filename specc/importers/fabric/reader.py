"""From the XML tree of a subsystem definition to its records."""

from __future__ import annotations

import os
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeVar

from specc.importers.carried import Notes
from specc.importers.fabric.definition import (
    IN_ERROR,
    OK,
    Arc,
    Asker,
    Behaviour,
    Buffer,
    Definition,
    State,
)
from specc.importers.logic import FALSE, Atom, Logic, LogicError, atoms, parse_logic
from specc.importers.markup import Element

_Named = TypeVar("_Named")


def read_definition(root: Element, notes: Notes) -> Definition | None:
    """The subsystem that a document defines; None, with errors in `notes`, if it is not whole."""
    root.seen = True
    if root.tag != "subsystem_definition":
        message = f"the root is <{root.tag}>, not <subsystem_definition>"
        notes.error("E0803", message, root.place, "is this a subsystem definition of FABRIC?")
        return None
    return _Reader(Asker(notes), notes, root).read()


def name_of(path: str) -> str:
    """The name of a subsystem: its file's, or its package's if the file is `subsystem.xml`."""
    folder, file = os.path.split(os.path.abspath(path))
    stem = os.path.splitext(file)[0]
    if stem != "subsystem":
        return stem
    folder, package = os.path.split(folder)
    return os.path.basename(folder) if package == "spec" else package


@dataclass(slots=True)
class _Reader:
    ask: Asker
    notes: Notes
    root: Element

    def read(self) -> Definition | None:
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
        return Definition(name, buffers, predicates, behaviours, states, initial, period, self.root)

    def _buffers(self) -> tuple[Buffer, ...]:
        section = self.ask.section(self.root, "buffers")
        found: dict[str, Buffer] = {}
        for element in section.all("in", "out") if section else ():
            alias = self.ask.name(element, "alias")
            message, side = self.ask.need(element, "type"), self.ask.need(element, "side").lower()
            if side not in ("top", "bottom", ""):
                text = f"`{side}` is not a side"
                place = element.value_place("side")
                self.notes.error("E0804", text, place, "the sides are `top` and `bottom`")
            if message and not all(part.isidentifier() for part in _split_type(message)):
                text, place = f"`{message}` is not a type", element.value_place("type")
                self.notes.error("E0804", text, place, "write `package::Message`")
            buffer = Buffer(alias, message, side, element.tag == "in", element)
            if self._keep(found, alias, buffer, f"buffer `{alias}`", element):
                continue
        return tuple(found.values())

    def _keep(
        self, found: dict[str, _Named], name: str, thing: _Named, what: str, element: Element
    ) -> bool:
        """Whether `thing` is the first of its name; a second one is reported."""
        if name in found:
            self.ask.twice(what, element)
            return False
        if name:
            found[name] = thing
        return bool(name)

    def _buffer_groups(self, inputs: set[str]) -> None:
        """Groups say what a state waits for; a subsystem of specc waits for nothing."""
        section = self.ask.section(self.root, "buffer_groups", needed=False)
        for group in section.all("buffer_group") if section else ():
            for member in group.children:
                name = member.attributes.get("name", "")
                if member.tag in ("obligatory", "optional") and name not in inputs:
                    self.ask.unknown("input buffer", name, member, "name")
        if section is not None:
            section.seen = False

    def _predicates(self) -> tuple[str, ...]:
        section = self.ask.section(self.root, "predicates")
        found: dict[str, Element] = {}
        for element in section.all("predicate") if section else ():
            name = self.ask.name(element)
            self._keep(found, name, element, f"predicate `{name}`", element)
        return tuple(found)

    def _behaviours(self, predicates: frozenset[str]) -> dict[str, Behaviour]:
        section = self.ask.section(self.root, "behaviors")
        found: dict[str, Behaviour] = {}
        for element in section.all("behavior") if section else ():
            name = self.ask.name(element)
            components = tuple(
                self.ask.need(item, "name") for item in element.all("running_component")
            )
            stop = self._condition(element, "stop_cond", predicates | {OK})
            error = self._condition(element, "err_cond", predicates | {OK})
            behaviour = Behaviour(name, stop, error, components, element)
            self._keep(found, name, behaviour, f"behavior `{name}`", element)
        return found

    def _states(
        self, predicates: frozenset[str], behaviours: dict[str, Behaviour]
    ) -> tuple[tuple[State, ...], str]:
        section = self.ask.section(self.root, "states")
        if section is None:
            return (), ""
        initial = self.ask.need(section, "initial")
        found: dict[str, State] = {}
        for element in section.all("state"):
            state = self._state(element, predicates, behaviours)
            self._keep(found, state.name, state, f"state `{state.name}`", element)
        if initial and initial not in found:
            self.ask.unknown("state", initial, section, "initial")
        for state in found.values():
            for arc in state.arcs:
                if arc.target and arc.target not in found:
                    self.ask.unknown("state", arc.target, arc.element, "name")
        return tuple(found.values()), initial

    def _state(
        self, element: Element, predicates: frozenset[str], behaviours: dict[str, Behaviour]
    ) -> State:
        name = self.ask.name(element)
        running = []
        for item in element.all("behavior"):
            behaviour = self.ask.need(item, "name")
            if behaviour and behaviour not in behaviours:
                self.ask.unknown("behavior", behaviour, item, "name")
            running.append(behaviour)
        if not running:
            message = f"state `{name}` needs an element <behavior>"
            self.notes.error("E0804", message, element.place, 'write `<behavior name="..."/>`')
        arcs = tuple(
            Arc(
                self.ask.need(item, "name"),
                self._condition(item, "init_cond", predicates | {OK, IN_ERROR}),
                item,
            )
            for item in element.all("next_state")
        )
        period = None
        for group in element.all("buffer_group"):
            period = self.ask.seconds(group, "min_period") or period
        return State(name, tuple(dict.fromkeys(running)), arcs, period, element)

    def _condition(self, element: Element, attribute: str, known: frozenset[str]) -> Logic:
        if not self.ask.need(element, attribute):
            return FALSE
        try:
            logic = parse_logic(element.attributes[attribute])
        except LogicError as error:
            place = element.value_place(attribute, error.start, error.end)
            help = "conditions join predicates by `and`, `or`, `not` and brackets"
            self.notes.error("E0807", error.message, place, help)
            return FALSE
        for atom in atoms(logic):
            if atom.text not in known:
                self._unknown_predicate(atom, element, attribute)
        return logic

    def _unknown_predicate(self, atom: Atom, element: Element, attribute: str) -> None:
        place = element.value_place(attribute, atom.start, atom.start + len(atom.text))
        message = f"there is no predicate `{atom.text}`"
        help = "declare the predicate, or correct the name"
        if atom.text == IN_ERROR:
            message = f"`{IN_ERROR}` is known only in `init_cond`"
            help = "a behavior is asked before it is known whether it ended in error"
        self.notes.error("E0805", message, place, help)

    def _trigger_methods(self, buffers: tuple[Buffer, ...]) -> Fraction | None:
        """The older form of the format: one period for all states, or triggers by data."""
        section = self.ask.section(self.root, "trigger_methods", needed=False)
        if section is None:
            return None
        aliases = {b.alias for b in buffers if b.is_input}
        for element in section.all("new_data_on_buffer", "no_data_on_buffer"):
            name = self.ask.need(element, "name")
            if name and name not in aliases:
                self.ask.unknown("input buffer", name, element, "name")
            element.seen = False
        period = None
        for element in section.all("interval"):
            period = self.ask.seconds(element, "min")
        for element in section.all("period"):
            period = self.ask.seconds(element, "value")
        return period


def _split_type(message: str) -> list[str]:
    return message.split("::") if message.count("::") == 1 else [""]
