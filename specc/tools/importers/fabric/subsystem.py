"""A subsystem of FABRIC as one of specc."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from specc.model.expr import FALSE, TRUE, BoundVariable, Expr, Unary
from specc.tools.importers.fabric.reader import (
    IN_ERROR,
    OK,
    FabricState,
    FabricSubsystem,
    NextState,
)
from specc.tools.importers.fabric.wiring import PARTS, Ends, SharedDefinitions
from specc.tools.importers.import_notes import Notes
from specc.tools.importers.logic import render, substitute
from specc.tools.importers.writing import Data, SpecNames, without_empty

# Behaviours, states and rows of a FABRIC subsystem in the terms of a specification.


class _Machine:
    """The Moore machine of a definition; its parts are data of the YAML."""

    def __init__(
        self, definition: FabricSubsystem, predicate: Callable[[str], str], notes: Notes
    ) -> None:
        """`predicate` gives the name of a predicate in the specification."""
        self.conditions: dict[str, dict[str, Data]] = {"initial": {}, "terminal": {}, "error": {}}
        self.behaviours: dict[str, Data] = {}
        self.running: dict[str, tuple[str, ...]] = {}
        """Behaviour -> the behaviours of FABRIC that run together in it."""
        self.transitions: list[Data] = []
        self._definition, self._predicate, self._notes = definition, predicate, notes
        self._names = {kind: SpecNames(("always", "never")) for kind in self.conditions}
        self._known: dict[tuple[str, str, str], str] = {}
        self._behaviour_names, self._state_names = SpecNames(), SpecNames()
        self.states: dict[str, Data] = {
            self._state_names.of(state.name): self._behaviour(state) for state in definition.states
        }
        self.initial = self._state_names.of(definition.initial)
        for state in definition.states:
            for arc in state.arcs:
                self._rows(state, arc)
        self._report()

    def _report(self) -> None:
        """Behaviours that are not carried over, and names that changed."""
        definition = self._definition
        executed = {name for state in definition.states for name in state.behaviours}
        for name, behaviour in definition.behaviours.items():
            if name not in executed:
                message = f"behavior `{name}` is not carried over: no state executes it"
                self._notes.lost(message, behaviour.element.value_place("name"))
        for old, new in self._state_names.renamed.items():
            place = next(s.element.place for s in definition.states if s.name == old)
            self._notes.changed(f"state `{old}` is called `{new}`", place)

    def _behaviour(self, state: FabricState) -> str:
        """The behaviour of a state; several that run together become one."""
        name = self._behaviour_names.of(" and ".join(state.behaviours))
        if name not in self.running:
            self.running[name] = state.behaviours
            stop, error = self._definition.stop(state), self._definition.error(state)
            self.behaviours[name] = {
                "functions": [name],
                "terminal": self._condition("terminal", stop, f"{name}_stops"),
                "error": self._condition("error", error, f"{name}_fails"),
            }
        return name

    def _rows(self, state: FabricState, arc: NextState) -> None:
        """A row for each cause under which the arc can be taken."""
        ends = {"terminal": self._definition.stop(state), "error": self._definition.error(state)}
        conditions = {
            cause: substitute(arc.condition, {IN_ERROR: cause == "error"}) for cause in ends
        }
        open_ = {cause: c for cause, c in conditions.items() if c != FALSE}
        if not open_:
            message = f"the arc from `{state.name}` to `{arc.target}` is never taken"
            self._notes.lost(message, arc.element.value_place("init_cond"))
        # An arc that no cause can lead to is kept, so that `specc validate` shows it.
        occurring = {cause: c for cause, c in open_.items() if ends[cause] != FALSE} or open_
        for cause, condition in occurring.items():
            wish = f"{state.name}_to_{arc.target}" + ("_in_error" if cause == "error" else "")
            name = self._condition("initial", condition, wish)
            source, target = (self._state_names.of(n) for n in (state.name, arc.target))
            self.transitions.append([source, cause, name, target])

    def _condition(self, kind: str, logic: Expr, wish: str) -> str:
        """The name of a condition; a single predicate gives its own name, wherever it is asked."""
        if logic in (TRUE, FALSE):
            return "always" if logic == TRUE else "never"
        match logic:
            case BoundVariable(name=predicate):
                wish = predicate
            case Unary(operand=BoundVariable(name=predicate)):
                wish = f"not_{predicate}"
        text = render(logic, self._predicate)
        key = kind, text, wish
        if key not in self._known:
            name = self._known[key] = self._names[kind].new(wish)
            self.conditions[kind][name] = text
        return self._known[key]


# One FABRIC subsystem as an agent of a specification, with stand-ins for what is outside.
#
# As in FABRIC, a predicate is asked about what was read (`input_data`) and about the components of
# the subsystem (`components`); a behaviour updates the components, which give the outputs.


class AgentMaker:
    """Makes the agents of one definition."""

    def __init__(
        self,
        definition: FabricSubsystem,
        rate: str,
        ends: Ends,
        library: SharedDefinitions,
        notes: Notes,
    ) -> None:
        self._definition, self._rate, self._ends = definition, rate, ends
        self._library, self._notes = library, notes
        self._module = ends.own + PARTS
        self._lets = SpecNames(("components",))
        self._let: dict[str, Data] = {}
        self._input_data = self._opaque("InputData", "what the subsystem has read")
        self._components = self._opaque("Components", "the components with their state")

    def agents(self) -> dict[str, Data]:
        """The subsystem itself and a stand-in for each side on which something is not connected."""
        return {self._ends.own: {"control": self._control()}, **self._ends.stand_ins()}

    def _control(self) -> dict[str, Data]:
        self._inputs()
        predicates = {name: self._predicate(name) for name in self._predicates()}
        parts = _Machine(self._definition, predicates.__getitem__, self._notes)
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
            "conditions": without_empty(parts.conditions),
            "functions": functions,
            "behaviours": parts.behaviours,
            "states": parts.states,
            "initial_state": parts.initial,
            "transitions": parts.transitions,
        }
        return without_empty(control)

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
        names = SpecNames()
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
        own = SpecNames().of(name)
        return self._library.operator(own, self._module, signature, title)
