"""A FABRIC subsystem definition as it is written: `<subsystem_definition>` read into records."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from specc.importers.carried import Notes
from specc.importers.logic import Logic, join
from specc.importers.markup import Element

OK, IN_ERROR = "CURRENT_BEHAVIOR_OK", "IN_ERROR"


@dataclass(frozen=True, slots=True)
class Buffer:
    """A buffer of the subsystem; `side` is `top` or `bottom`."""

    alias: str
    type: str
    side: str
    is_input: bool
    element: Element


@dataclass(frozen=True, slots=True)
class Behaviour:
    """What runs in a state; conditions are over predicates."""

    name: str
    stop: Logic
    error: Logic
    components: tuple[str, ...]
    element: Element


@dataclass(frozen=True, slots=True)
class Arc:
    """A `<next_state>`."""

    target: str
    condition: Logic
    element: Element


@dataclass(frozen=True, slots=True)
class State:
    """All behaviours of a state run together; a condition of any of them ends it."""

    name: str
    behaviours: tuple[str, ...]
    arcs: tuple[Arc, ...]
    period_s: Fraction | None
    element: Element


@dataclass(frozen=True, slots=True)
class Definition:
    """One subsystem; its name is not in the file, so it comes from the path."""

    name: str
    buffers: tuple[Buffer, ...]
    predicates: tuple[str, ...]
    behaviours: dict[str, Behaviour]
    states: tuple[State, ...]
    initial: str
    period_s: Fraction | None
    root: Element

    def buffer(self, alias: str) -> Buffer | None:
        """The buffer of an alias."""
        return next((b for b in self.buffers if b.alias == alias), None)

    def stop(self, state: State) -> Logic:
        """When a state is left without an error: FABRIC asks any of its behaviours."""
        return join("or", tuple(self.behaviours[b].stop for b in state.behaviours))

    def error(self, state: State) -> Logic:
        """When a state is left in error."""
        return join("or", tuple(self.behaviours[b].error for b in state.behaviours))


@dataclass(slots=True)
class Asker:
    """Takes values from elements and reports what is missing or twice there."""

    notes: Notes

    def need(self, element: Element, attribute: str) -> str:
        """The value of an attribute; a missing or empty one is an error and gives ""."""
        value = element.get(attribute)
        if value:
            return value
        message = f"<{element.tag}> needs the attribute `{attribute}`"
        self.notes.error("E0804", message, element.place, f'write `{attribute}="..."`')
        return ""

    def name(self, element: Element, attribute: str = "name") -> str:
        """The value of an attribute that names something; FABRIC makes C++ of it."""
        value = self.need(element, attribute)
        if value and not (value.isidentifier() and value.isascii()):
            message, place = f"`{value}` is not a name", element.value_place(attribute)
            self.notes.error("E0804", message, place, "write letters, digits and underscores")
        return value

    def section(self, root: Element, tag: str, *, needed: bool = True) -> Element | None:
        """The only child of a tag; a missing or a second one is an error."""
        found = root.all(tag)
        if not found and needed:
            message = f"<{root.tag}> needs an element <{tag}>"
            self.notes.error("E0804", message, root.place, f"write `<{tag}> ... </{tag}>`")
        for second in found[1:]:
            self.twice(f"<{tag}>", second)
        return found[0] if found else None

    def twice(self, what: str, element: Element) -> None:
        """Report the second of two things that must be one."""
        place = element.value_place("name") if "name" in element.attributes else element.place
        self.notes.error("E0806", f"{what} is there twice", place, "delete or rename one of them")

    def unknown(self, what: str, name: str, element: Element, attribute: str) -> None:
        """Report a name that nothing has."""
        message = f"there is no {what} `{name}`"
        place = element.value_place(attribute)
        self.notes.error("E0805", message, place, f"declare the {what}, or correct the name")

    def seconds(self, element: Element, attribute: str) -> Fraction | None:
        """A positive time; zero, which FABRIC takes for `at once`, is None."""
        text = self.need(element, attribute)
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
