"""Subsystem definitions of FABRIC, read from `<subsystem_definition>`."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TypeVar

from specc.model.expr import FALSE, Expr
from specc.tools.importers.logic import LogicError, atoms, join, parse_logic
from specc.tools.importers.reading import Notes, XmlElement

OK, IN_ERROR = "CURRENT_BEHAVIOR_OK", "IN_ERROR"
_Named = TypeVar("_Named")


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
    buffers: dict[str, Buffer]
    predicates: tuple[str, ...]
    behaviours: dict[str, Behaviour]
    states: tuple[FabricState, ...]
    initial: str
    period_s: Fraction | None
    root: XmlElement

    def buffers_of(self, *, inputs: bool) -> list[Buffer]:
        """The input or the output buffers."""
        return [buffer for buffer in self.buffers.values() if buffer.is_input == inputs]

    def ends(self, state: FabricState) -> dict[str, Expr]:
        """When a state is left, by causes: FABRIC asks any of its behaviours."""
        behaviours = [self.behaviours[name] for name in state.behaviours]
        return {
            "terminal": join("or", (each.stop for each in behaviours)),
            "error": join("or", (each.error for each in behaviours)),
        }


def read_definition(root: XmlElement, notes: Notes) -> FabricSubsystem | None:
    """The subsystem that a document defines; None, with errors in `notes`, if it is not whole."""
    root.used = True
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
        buffers = self._by_name("buffers", ("in", "out"), "buffer", self._buffer, "alias")
        inputs = {name for name, buffer in buffers.items() if buffer.is_input}
        self._check_groups(inputs)
        predicates = self._by_name("predicates", ("predicate",), "predicate", lambda e, _: e)
        known = frozenset((*predicates, OK))
        behaviours = self._by_name(
            "behaviors", ("behavior",), "behavior", lambda e, name: self._behaviour(e, name, known)
        )
        section = next((each for each in self.root.children if each.tag == "states"), None)
        initial = self.notes.need(section, "initial") if section else ""
        states = self._by_name(
            "states", ("state",), "state", lambda e, name: self._state(e, name, known, behaviours)
        )
        if section and initial and initial not in states:
            self._unknown("state", initial, section, "initial")
        for arc in (arc for state in states.values() for arc in state.arcs):
            if arc.target and arc.target not in states:
                self._unknown("state", arc.target, arc.element, "name")
        period = self._trigger_period(inputs)
        if any(d.severity == "error" for d in self.notes.diagnostics[before:]):
            return None
        return FabricSubsystem(
            name_of(self.root.path),
            buffers,
            tuple(predicates),
            behaviours,
            tuple(states.values()),
            initial,
            period,
            self.root,
        )

    def _by_name(
        self,
        section: str,
        tags: tuple[str, ...],
        kind: str,
        read: Callable[[XmlElement, str], _Named],
        attribute: str = "name",
    ) -> dict[str, _Named]:
        """What a section declares, by names; the second of one name is reported."""
        found: dict[str, _Named] = {}
        parent = self._section(section)
        for element in parent.all(*tags) if parent else ():
            name = self.notes.need(element, attribute)
            if name and not (name.isidentifier() and name.isascii()):  # FABRIC makes C++ of it
                help = "write letters, digits and underscores"
                self._illegal(f"`{name}` is not a name", element, attribute, help)
            declared = read(element, name)
            if name in found:
                self._report_second(f"{kind} `{name}`", element)
            elif name:
                found[name] = declared
        return found

    def _buffer(self, element: XmlElement, alias: str) -> Buffer:
        message = self.notes.need(element, "type")
        side = self.notes.need(element, "side").lower()
        if side not in ("top", "bottom", ""):
            help = "the sides are `top` and `bottom`"
            self._illegal(f"`{side}` is not a side", element, "side", help)
        parts = message.split("::")
        if message and not (len(parts) == 2 and all(part.isidentifier() for part in parts)):
            help = "write `package::Message`"
            self._illegal(f"`{message}` is not a type", element, "type", help)
        return Buffer(alias, message, side, element.tag == "in", element)

    def _check_groups(self, inputs: set[str]) -> None:
        """Groups say what data a state waits for; a subsystem of specc never waits for data."""
        section = self._section("buffer_groups", needed=False)
        if section is None:
            return
        for group in section.all("buffer_group"):
            for member in group.children:
                name = member.attributes.get("name", "")
                if member.tag in ("obligatory", "optional") and name not in inputs:
                    self._unknown("input buffer", name, member, "name")
        section.used = False

    def _behaviour(self, element: XmlElement, name: str, known: frozenset[str]) -> Behaviour:
        components = [self.notes.need(item, "name") for item in element.all("running_component")]
        stop = self._condition(element, "stop_cond", known)
        error = self._condition(element, "err_cond", known)
        return Behaviour(name, stop, error, tuple(components), element)

    def _state(
        self,
        element: XmlElement,
        name: str,
        known: frozenset[str],
        behaviours: dict[str, Behaviour],
    ) -> FabricState:
        running = []
        for item in element.all("behavior"):
            behaviour = self.notes.need(item, "name")
            if behaviour and behaviour not in behaviours:
                self._unknown("behavior", behaviour, item, "name")
            running.append(behaviour)
        if not running:
            message = f"state `{name}` needs an element <behavior>"
            self.notes.error("E0803", message, element.place, 'write `<behavior name="..."/>`')
        arcs = []
        for item in element.all("next_state"):
            target = self.notes.need(item, "name")
            condition = self._condition(item, "init_cond", known | {IN_ERROR})
            arcs.append(NextState(target, condition, item))
        period = None
        for group in element.all("buffer_group"):
            period = self._seconds(group, "min_period") or period
        return FabricState(name, tuple(dict.fromkeys(running)), tuple(arcs), period, element)

    def _condition(self, element: XmlElement, attribute: str, known: frozenset[str]) -> Expr:
        if not self.notes.need(element, attribute):
            return FALSE
        try:
            logic = parse_logic(element.attributes[attribute])
        except LogicError as error:
            place = element.value_place(attribute, error.start, error.end)
            help = "conditions join predicates by `and`, `or`, `not` and brackets"
            self.notes.error("E0803", error.message, place, help)
            return FALSE
        for atom in atoms(logic):
            if atom.name in known:
                continue
            message = f"there is no predicate `{atom.name}`"
            help = "declare the predicate, or correct the name"
            if atom.name == IN_ERROR:
                message = f"`{IN_ERROR}` is known only in `init_cond`"
                help = (
                    "conditions of a behavior are evaluated before it is known whether "
                    "it ended in error"
                )
            self.notes.error("E0803", message, element.value_place(attribute, *atom.span), help)
        return logic

    def _trigger_period(self, inputs: set[str]) -> Fraction | None:
        """The older form of the format: one period for all states, or triggers by data."""
        section = self._section("trigger_methods", needed=False)
        if section is None:
            return None
        for element in section.all("new_data_on_buffer", "no_data_on_buffer"):
            name = self.notes.need(element, "name")
            if name and name not in inputs:
                self._unknown("input buffer", name, element, "name")
            element.used = False
        period = None
        for tag, attribute in (("interval", "min"), ("period", "value")):
            for element in section.all(tag):
                period = self._seconds(element, attribute)
        return period

    def _section(self, tag: str, *, needed: bool = True) -> XmlElement | None:
        """The only child of a tag; a missing or a second one is an error."""
        found = self.root.all(tag)
        if not found and needed:
            message = f"<{self.root.tag}> needs an element <{tag}>"
            self.notes.error("E0803", message, self.root.place, f"write `<{tag}> ... </{tag}>`")
        for second in found[1:]:
            self._report_second(f"<{tag}>", second)
        return found[0] if found else None

    def _report_second(self, what: str, element: XmlElement) -> None:
        place = element.value_place("name") if "name" in element.attributes else element.place
        self.notes.error("E0803", f"{what} is there twice", place, "delete or rename one of them")

    def _unknown(self, what: str, name: str, element: XmlElement, attribute: str) -> None:
        help = f"declare the {what}, or correct the name"
        place = element.value_place(attribute)
        self.notes.error("E0803", f"there is no {what} `{name}`", place, help)

    def _illegal(self, message: str, element: XmlElement, attribute: str, help: str) -> None:
        self.notes.error("E0803", message, element.value_place(attribute), help)

    def _seconds(self, element: XmlElement, attribute: str) -> Fraction | None:
        """A positive time; zero, which FABRIC takes for `at once`, is None."""
        text = self.notes.need(element, attribute)
        try:
            # Through a float: the Fraction of `1e999999999` is computed digit by digit.
            rough = float(text)
            if not 0.0 <= rough <= 3600.0 or 0.0 < rough < 1e-7:
                raise ValueError
            return Fraction(str(rough)) or None
        except ValueError:
            if text:
                help = "write a number such as 0.001"
                self._illegal(f"`{text}` is not a time in seconds", element, attribute, help)
            return None
