"""The subsystems in a sheet, in the words of their machines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from bench.seeding.sheet import Sheet
from specc.source import Node, Route

KINDS = ("initial", "terminal", "error")


@dataclass(frozen=True, slots=True)
class Machine:
    """A subsystem that is described in a sheet, at a route."""

    sheet: Sheet
    route: Route

    @property
    def is_control(self) -> bool:
        """Whether it is the control subsystem of an agent."""
        return self.route[-1] == "control"

    def below(self, *steps: str | int) -> Route:
        """Route to a part."""
        return (*self.route, *steps)

    def get(self, *steps: str | int) -> Any:
        """Data of a part; an empty mapping if there is none."""
        return self.sheet.get(self.below(*steps), {})

    def entries(self, *steps: str | int) -> list[Route]:
        """Routes of the parts of a part."""
        return self.sheet.entries(self.below(*steps))

    def rows(self) -> list[tuple[Route, list[str]]]:
        """Routes and cells of the rows of the transition table."""
        return [(route, self.sheet.get(route)) for route in self.entries("transitions")]

    def rows_of(self, state: str, cause: str) -> list[tuple[Route, list[str]]]:
        """The rows of a state for a cause."""
        return [(route, row) for route, row in self.rows() if row[:2] == [state, cause]]

    def behaviour_of(self, state: str) -> str:
        """Name of the behaviour of a state."""
        entry = self.get("states", state)
        return str(entry["behaviour"] if isinstance(entry, dict) else entry)

    def functions_of(self, behaviour: str) -> list[str]:
        """Names of the functions of a behaviour."""
        return list(self.get("behaviours", behaviour).get("functions", []))

    def targets_of(self, function: str) -> dict[str, Route]:
        """What a function assigns, with the routes."""
        route = self.below("functions", function)
        names = set(self.sheet.get(route)) - {"title", "eq", "table", "fig"}
        return {name: (*route, name) for name in self.sheet.get(route) if name in names}

    def text_of(self, kind: str, name: str) -> str:
        """Expression of a condition as text."""
        if name in ("always", "never"):
            return str(name == "always")
        entry = self.get("conditions", kind, name)
        return str(entry["when"] if isinstance(entry, dict) else entry)

    def ends(self, state: str, cause: str) -> str:
        """Expression of the terminal or error condition of a state."""
        behaviour = self.get("behaviours", self.behaviour_of(state))
        return self.text_of(cause, behaviour.get(cause, "never"))

    def expressions(self) -> Iterator[tuple[str, Route]]:
        """The expressions, each with its kind: init, memory, let, condition or function."""
        sheet = self.sheet
        for peer in self.entries("x"):
            for element in sheet.entries(peer):
                if sheet.has((*element, "init")):
                    yield "init", (*element, "init")
        for route in self.entries("memory"):
            yield "memory", (*route, "init")
        for route in self.entries("let"):
            yield "let", sheet.scalar(route, "is")
        for kind in KINDS:
            for route in self.entries("conditions", kind):
                yield "condition", sheet.scalar(route, "when")
        for function in self.get("functions"):
            for route in self.targets_of(function).values():
                yield "function", sheet.scalar(route, "is")

    def elements(self, direction: str) -> Iterator[Route]:
        """Routes of the elements of the input or output buffers."""
        for peer in self.entries(direction):
            yield from self.sheet.entries(peer)

    def names(self) -> set[str]:
        """Names of memory, lets and the file's constants and parameters."""
        return {*self.get("memory"), *self.get("let"), *constants(self.sheet)}

    def uses(self, name: str) -> list[Node]:
        """Where expressions call a name."""
        return [word for _, route in self.expressions() for word in self.sheet.words(route, {name})]

    def place_of(self, state: str) -> int:
        """Place of a state, which stands for the rows that it lacks."""
        return self.sheet.key(self.below("states", state)).start


def machines(sheet: Sheet) -> list[Machine]:
    """The subsystems that a sheet describes itself."""
    found: list[Route] = [("subsystem",)] if sheet.has(("subsystem",)) else []
    for agent in sheet.entries(("agents",)):
        found.append((*agent, "control"))
        found += sheet.entries((*agent, "virtual_effectors"))
        found += sheet.entries((*agent, "virtual_receptors"))
    return [Machine(sheet, route) for route in found if sheet.has((*route, "states"))]


def constants(sheet: Sheet) -> set[str]:
    """Names of the constants and parameters of a file."""
    return {*sheet.get(("constants",), {}), *sheet.get(("parameters",), {})}
