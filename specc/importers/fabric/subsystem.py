"""One FABRIC subsystem as an agent of a specification, with stand-ins for what is outside.

As in FABRIC, a predicate is asked about what was read (`input_data`) and about the components of
the subsystem (`components`); a behaviour updates the components, which give the outputs.
"""

from __future__ import annotations

from collections.abc import Iterable

from specc.importers.carried import Notes
from specc.importers.fabric.definition import OK, Definition
from specc.importers.fabric.ends import Ends
from specc.importers.fabric.library import PARTS, Library
from specc.importers.fabric.machine import machine
from specc.importers.names import Names
from specc.importers.yaml import Data


class Subsystem:
    """Makes the agents of one definition."""

    def __init__(
        self, definition: Definition, rate: str, ends: Ends, library: Library, notes: Notes
    ) -> None:
        self._definition, self._rate, self._ends = definition, rate, ends
        self._library, self._notes = library, notes
        self._module = ends.own + PARTS
        self._lets = Names(("components",))
        self._let: dict[str, Data] = {}
        self._input_data = self._opaque("InputData", "what the subsystem has read")
        self._components = self._opaque("Components", "the components with their state")

    def agents(self) -> dict[str, Data]:
        """The subsystem itself and a stand-in for each side on which something is not connected."""
        return {self._ends.own: {"control": self._control()}, **self._ends.stand_ins()}

    def _control(self) -> dict[str, Data]:
        self._inputs()
        predicates = {name: self._predicate(name) for name in self._predicates()}
        parts = machine(self._definition, predicates.__getitem__, self._notes)
        functions: dict[str, Data] = {
            name: self._function(name, running) for name, running in parts.running.items()
        }
        start = self._operator("components", f"() -> {self._components}", "components at the start")
        control: dict[str, Data] = {
            "title": self._definition.name,
            "rate": self._rate,
            "x": self._ends.buffers(inputs=True),
            "y": self._ends.buffers(inputs=False),
            "memory": {"components": {"type": self._components, "init": f"{start}()"}},
            "let": self._let,
            "conditions": {kind: group for kind, group in parts.conditions.items() if group},
            "functions": functions,
            "behaviours": parts.behaviours,
            "states": parts.states,
            "initial_state": parts.initial,
            "transitions": parts.transitions,
        }
        return {key: value for key, value in control.items() if value}

    def _predicates(self) -> Iterable[str]:
        used = [OK] if self._uses_ok() else []
        return [*used, *self._definition.predicates]

    def _uses_ok(self) -> bool:
        states = self._definition.states
        elements = [b.element for b in self._definition.behaviours.values()]
        elements += [arc.element for state in states for arc in state.arcs]
        return any(OK in text for element in elements for text in element.attributes.values())

    def _predicate(self, name: str) -> str:
        let = self._lets.of(name)
        if name == OK:
            signature = f"(components: {self._components}) -> bool"
            title = "whether the components that must run do, and no others"
            self._let[let] = f"{self._operator(name, signature, title)}(components)"
            return let
        signature = f"(input_data: {self._input_data}, components: {self._components}) -> bool"
        operator = self._operator(name, signature, f"predicate {name}")
        self._let[let] = f"{operator}({self._lets.of('input_data')}, components)"
        if let != name:
            self._notes.changed(
                f"predicate `{name}` is called `{let}`", self._definition.root.place
            )
        return let

    def _inputs(self) -> None:
        """`input_data` gathers every input buffer and whether something new came into it."""
        parameters, arguments = [], []
        names = Names()
        for buffer in self._definition.buffers:
            if buffer.is_input:
                alias, value = names.of(buffer.alias), self._ends.input(buffer)
                parameters += [f"{alias}: {self._library.message(buffer.type)}"]
                parameters += [f"{names.new(alias + '_new')}: bool"]
                arguments += [value, f"fresh({value})"]
        signature = f"({', '.join(parameters)}) -> {self._input_data}"
        operator = self._operator("input_data", signature, "what predicates and components see")
        self._let[self._lets.of("input_data")] = f"{operator}({', '.join(arguments)})"

    def _function(self, name: str, running: tuple[str, ...]) -> dict[str, Data]:
        """One update of the components that a behaviour runs, and the outputs they give."""
        components = dict.fromkeys(
            c for b in running for c in self._definition.behaviours[b].components
        )
        signature = (
            f"(components: {self._components}, input_data: {self._input_data})"
            f" -> {self._components}"
        )
        title = f"one update of {', '.join(components)}" if components else "nothing runs"
        operator = self._operator(f"run_{name}", signature, title)
        let = self._lets.new(f"components_after_{name}")
        self._let[let] = f"{operator}(components, {self._lets.of('input_data')})"
        targets: dict[str, Data] = {"components": let}
        for buffer in self._definition.buffers:
            if not buffer.is_input:
                output = f"(components: {self._components}) -> {self._library.message(buffer.type)}"
                gives = self._operator(buffer.alias, output, f"contents of {buffer.alias}")
                targets |= dict.fromkeys(self._ends.outputs(buffer), f"{gives}({let})")
        return targets

    def _opaque(self, name: str, title: str) -> str:
        return self._library.opaque(name, self._module, title)

    def _operator(self, name: str, signature: str, title: str) -> str:
        own = Names().of(name)
        return self._library.operator(own, self._module, signature, title)
