"""Behaviours, states and rows of a FABRIC subsystem in the terms of a specification."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from specc.importers.carried import Notes
from specc.importers.fabric.definition import IN_ERROR, Arc, Definition, State
from specc.importers.logic import FALSE, TRUE, Atom, Logic, Not, render, substitute
from specc.importers.names import Names
from specc.importers.yaml import Data


@dataclass(slots=True)
class Machine:
    """The parts of a specification, as data of its YAML."""

    conditions: dict[str, dict[str, Data]] = field(
        default_factory=lambda: {"initial": {}, "terminal": {}, "error": {}}
    )
    behaviours: dict[str, Data] = field(default_factory=dict)
    running: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Behaviour -> the behaviours of FABRIC that run together in it."""
    states: dict[str, Data] = field(default_factory=dict)
    initial: str = ""
    transitions: list[Data] = field(default_factory=list)


def machine(definition: Definition, predicate: Callable[[str], str], notes: Notes) -> Machine:
    """The Moore machine; `predicate` gives the name of a predicate in the specification."""
    return _Maker(definition, predicate, notes).make()


class _Maker:
    def __init__(
        self, definition: Definition, predicate: Callable[[str], str], notes: Notes
    ) -> None:
        self._definition = definition
        self._predicate = predicate
        self._notes = notes
        self._machine = Machine()
        self._names = {kind: Names(("always", "never")) for kind in self._machine.conditions}
        self._known: dict[tuple[str, str, str], str] = {}
        self._behaviour_names = Names()
        self._state_names = Names()

    def make(self) -> Machine:
        definition = self._definition
        for state in definition.states:
            self._machine.states[self._state_names.of(state.name)] = self._behaviour(state)
        self._machine.initial = self._state_names.of(definition.initial)
        for state in definition.states:
            for arc in state.arcs:
                self._rows(state, arc)
        executed = {name for state in definition.states for name in state.behaviours}
        for name, behaviour in definition.behaviours.items():
            if name not in executed:
                message = f"behavior `{name}` is not carried over: no state executes it"
                self._notes.lost(message, behaviour.element.value_place("name"))
        for old, new in self._state_names.changed.items():
            place = next(s.element.place for s in definition.states if s.name == old)
            self._notes.changed(f"state `{old}` is called `{new}`", place)
        return self._machine

    def _behaviour(self, state: State) -> str:
        """The behaviour of a state; several that run together become one."""
        name = self._behaviour_names.of(" and ".join(state.behaviours))
        if name not in self._machine.running:
            self._machine.running[name] = state.behaviours
            stop, error = self._definition.stop(state), self._definition.error(state)
            self._machine.behaviours[name] = {
                "functions": [name],
                "terminal": self._condition("terminal", stop, f"{name}_stops"),
                "error": self._condition("error", error, f"{name}_fails"),
            }
        return name

    def _rows(self, state: State, arc: Arc) -> None:
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
            self._machine.transitions.append([source, cause, name, target])

    def _condition(self, kind: str, logic: Logic, wish: str) -> str:
        """The name of a condition; a single predicate gives its own name, wherever it is asked."""
        if logic in (TRUE, FALSE):
            return "always" if logic == TRUE else "never"
        match logic:
            case Atom(text=predicate):
                wish = predicate
            case Not(operand=Atom(text=predicate)):
                wish = f"not_{predicate}"
        text = render(logic, self._predicate)
        key = kind, text, wish
        if key not in self._known:
            name = self._known[key] = self._names[kind].new(wish)
            self._machine.conditions[kind][name] = text
        return self._known[key]
