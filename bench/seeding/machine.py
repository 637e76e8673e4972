"""The subsystems in a sheet, in the words of their machines."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from bench.seeding.sheet import Edit, Sheet
from specc.source import Route, TextNode

KINDS = ("initial", "terminal", "error")
CAUSES = KINDS[1:]
OTHERWISE = "otherwise"
_ABOUT = frozenset(("title", "eq", "table", "fig"))
_NO_ELEMENTS = _ABOUT | {"frames", "types"}


class Row(NamedTuple):
    """A row of the transition table: that of one state, where several share a line."""

    state: str
    cause: str
    condition: str
    target: str
    route: Route
    """Where the line is."""
    source: Route
    """Where its state is named, which is in a list if several share the line."""

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """What the line says of the state."""
        return self[:4]


@dataclass(frozen=True, slots=True)
class Machine:
    """A subsystem that is described in a sheet, at a route."""

    sheet: Sheet
    route: Route

    @property
    def is_control(self) -> bool:
        """Whether it is the control subsystem of an agent."""
        return self.route[-1] == "control"

    @property
    def agent(self) -> Route:
        """Route of its agent, if it has one in the same file."""
        return self.route[: 2 if self.route[0] == "agents" else 1]

    def below(self, *steps: str | int) -> Route:
        """Route to a part."""
        return (*self.route, *steps)

    def get(self, *steps: str | int) -> Any:
        """Data of a part; an empty mapping if there is none."""
        return self.sheet.get(self.below(*steps), {})

    def entries(self, *steps: str | int) -> list[Route]:
        """Routes of the parts of a part."""
        return self.sheet.entries(self.below(*steps))

    def rows(self) -> list[Row]:
        """The rows of the transition table."""
        found = []
        for route in self.entries("transitions"):
            state, cause, condition, target = self.sheet.get(route)
            named = (*route, 0)
            sources = self.sheet.entries(named) if isinstance(state, list) else [named]
            found += [
                Row(self.sheet.get(at), cause, condition, target, route, at) for at in sources
            ]
        return found

    def rows_of(self, state: str, cause: str) -> list[Row]:
        """The rows of a state for a cause."""
        return [row for row in self.rows() if row[:2] == (state, cause)]

    def without(self, row: Row) -> Edit:
        """The edit that takes a row away: its state where others share the line, or the line."""
        named = row.source[:-1]
        shared = named != row.route and len(self.sheet.entries(named)) > 1
        return self.sheet.removed(row.source if shared else row.route)

    def has_otherwise(self, state: str, cause: str) -> bool:
        """Whether a row of a state and cause applies where no other does."""
        return any(row.condition == OTHERWISE for row in self.rows_of(state, cause))

    def behaviour_of(self, state: str) -> str:
        """Name of the behaviour of a state."""
        entry = self.get("states", state)
        return str(entry["behaviour"] if isinstance(entry, dict) else entry)

    def functions(self) -> list[Route]:
        """Routes of the functions, those in place among them."""
        found = self.entries("functions")
        for behaviour in self.entries("behaviours"):
            listed = self.sheet.entries((*behaviour, "functions"))
            found += [route for route in listed if isinstance(self.sheet.get(route), dict)]
        return found

    def functions_of(self, behaviour: str) -> list[Route]:
        """Routes of the functions of a behaviour."""
        listed = self.entries("behaviours", behaviour, "functions")
        found = [(route, self.sheet.get(route)) for route in listed]
        return [at if isinstance(f, dict) else self.below("functions", f) for at, f in found]

    def targets_of(self, function: Route) -> dict[str, Route]:
        """What a function assigns, with the routes."""
        return {name: (*function, name) for name in self.sheet.get(function) if name not in _ABOUT}

    def conditions(self, kind: str) -> list[Route]:
        """Routes of the conditions of a kind, those in place among them."""
        ends = [(*behaviour, kind) for behaviour in self.entries("behaviours")]
        in_place = [route for route in ends if isinstance(self.sheet.get(route), dict)]
        return self.entries("conditions", kind) + in_place

    def end(self, behaviour: str, cause: str) -> Route | None:
        """Route of the condition that ends a behaviour; none if it is `always` or `never`."""
        end = self.get("behaviours", behaviour).get(cause, "never")
        if isinstance(end, dict):
            return self.below("behaviours", behaviour, cause)
        return None if end in ("always", "never") else self.below("conditions", cause, end)

    def text_of(self, kind: str, name: str) -> str:
        """Expression of a condition as text."""
        if name in ("always", "never"):
            return str(name == "always")
        return self._text(self.below("conditions", kind, name))

    def _text(self, condition: Route) -> str:
        return str(self.sheet.get(self.sheet.scalar(condition, "when")))

    def ends(self, behaviour: str, cause: str) -> str:
        """Expression of the terminal or error condition of a behaviour as text."""
        route = self.end(behaviour, cause)
        if route is None:
            return self.text_of(cause, self.get("behaviours", behaviour).get(cause, "never"))
        return self._text(route)

    def expressions(self) -> Iterator[tuple[str, Route]]:
        """The expressions, each with its kind: init, memory, let, condition or function."""
        sheet = self.sheet
        for element in self.elements("x"):
            if sheet.has((*element, "init")):
                yield "init", (*element, "init")
        for route in self.entries("memory"):
            yield "memory", (*route, "init")
        for route in self.entries("let"):
            yield "let", sheet.scalar(route, "is")
        for kind in KINDS:
            for route in self.conditions(kind):
                yield "condition", sheet.scalar(route, "when")
        for function in self.functions():
            for route in self.targets_of(function).values():
                yield "function", sheet.scalar(route, "is")

    def elements(self, direction: str) -> Iterator[Route]:
        """Routes of the elements of the input or output buffers."""
        for peer in self.entries(direction):
            yield from elements(self.sheet, peer)

    def element(self, direction: str, peer: str, name: str) -> Route | None:
        """Route of an element of a buffer, if there is such."""
        listed = elements(self.sheet, self.below(direction, peer))
        return next((route for route in listed if route[-1] == name), None)

    def names(self) -> set[str]:
        """Names of memory, lets and the file's constants and parameters."""
        return {*self.get("memory"), *self.get("let"), *constants(self.sheet)}

    def uses(self, name: str) -> list[TextNode]:
        """Where expressions call a name."""
        return [word for _, route in self.expressions() for word in self.sheet.words(route, {name})]

    def place_of(self, state: str) -> int:
        """Place of a state, which stands for the rows that it lacks."""
        return self.sheet.key(self.below("states", state)).start


def machines(sheet: Sheet) -> list[Machine]:
    """The subsystems that a sheet describes itself."""
    found: list[Route] = [("subsystem",)]
    for agent in [("agent",), *sheet.entries(("agents",))]:
        found.append((*agent, "control"))
        found += sheet.entries((*agent, "virtual_effectors"))
        found += sheet.entries((*agent, "virtual_receptors"))
    return [Machine(sheet, route) for route in found if sheet.has((*route, "states"))]


def lost_without(machine: Machine, row: Row) -> set[str]:
    """The states that cannot be reached without a row."""
    arcs = [(other.state, other.target) for other in machine.rows()]
    others = [(other.state, other.target) for other in machine.rows() if other != row]
    return reached(machine, arcs) - reached(machine, others)


def reached(machine: Machine, arcs: Sequence[tuple[str, str]]) -> set[str]:
    """The states that can be reached from the initial one, by steps from state to state."""
    found, added = set(), {str(machine.get("initial_state"))}
    while added:
        found |= added
        added = {target for source, target in arcs if source in found} - found
    return found


def given_agents(sheet: Sheet) -> list[Route]:
    """Arguments that are agents of the system."""
    agents = sheet.get(("agents",), {})
    given = [route for route in sheet.walk() if route[-2:-1] == ("with",)]
    return [route for route in given if sheet.get(route) in agents]


def constants(sheet: Sheet) -> set[str]:
    """Names of the constants and parameters of a file."""
    return {*sheet.get(("constants",), {}), *sheet.get(("parameters",), {})}


def elements(sheet: Sheet, buffer: Route) -> list[Route]:
    """Routes of the elements of a buffer: those of an interface where it names one."""
    entry = sheet.get(buffer, {})
    if isinstance(entry, str):
        return of_interface(sheet, entry)
    shared = of_interface(sheet, entry["is"]) if isinstance(entry.get("is"), str) else []
    return shared + [route for route in sheet.entries(buffer) if route[-1] != "is"]


def of_interface(sheet: Sheet, named: str) -> list[Route]:
    """Routes of the elements of an interface, which is named with or without its parameters."""
    entries = sheet.entries(("interfaces", named.partition("[")[0]))
    return [route for route in entries if route[-1] not in _NO_ELEMENTS]
