"""What a run can try of a specification, and what one step of a machine tries of it.

States, rows, functions and conditions are those of a machine. A row counts as it is written: that
of a mode is one, whatever state of the mode it leaves. A condition is two items, that it was true
and that it was false; `always`, `never` and `otherwise` are none, and neither are other constants.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, Protocol

from specc.lower.subsystem import EquationNumbers, Equations
from specc.model.expr import FALSE, TRUE
from specc.model.fsm import OTHERWISE, Condition, Function, Trace, Transition, cause_words
from specc.model.requirement import Requirement
from specc.model.system import Subsystem, System
from specc.reachable import grouped
from specc.source import Place

ItemKind = Literal["state", "row", "condition", "function", "equation", "requirement"]
KINDS: tuple[ItemKind, ...] = ("state", "row", "condition", "function", "equation", "requirement")
_CONSTANT = "always", "never", OTHERWISE
Passage = tuple[str, str, str]
"""State before (empty in the first period), label of the row taken, empty for none, and the state
whose behaviour ran."""


@dataclass(frozen=True, slots=True)
class CoverageItem:
    """A part of a specification, of a subsystem if that is not empty; `truth` is of a condition."""

    kind: ItemKind
    subsystem: str
    name: str
    place: Place
    truth: bool | None = None


class MachineItems:
    """The items of one subsystem."""

    def __init__(self, system: System, subsystem: Subsystem) -> None:
        self.subsystem = subsystem
        self._equations = Equations(system, subsystem)
        self._states = {s.name: self._item("state", s.name, s.place) for s in subsystem.states}
        names = _row_names(subsystem)
        rows = subsystem.transitions
        self._indices = {row.label: index for index, row in reversed([*enumerate(rows)])}
        self._rows = [self._item("row", names[row.written], row.place) for row in rows]
        self._functions = {
            function.place: self._item("function", _function_name(function), function.place)
            for function in reversed(subsystem.functions)
        }
        self._conditions = {
            (each.name, truth): self._item("condition", each.name, each.place, truth)
            for each in _conditions(subsystem)
            if each.name not in _CONSTANT and each.when not in (TRUE, FALSE)
            for truth in (True, False)
        }

    def _item(
        self, kind: ItemKind, name: str, place: Place, truth: bool | None = None
    ) -> CoverageItem:
        return CoverageItem(kind, self.subsystem.qualified_name, name, place, truth)

    def items(self) -> Iterator[CoverageItem]:
        """All of them, in order of the file."""
        yield from self._states.values()
        yield from dict.fromkeys(self._rows)
        yield from self._conditions.values()
        yield from reversed(self._functions.values())

    @cached_property
    def rows(self) -> dict[CoverageItem, list[tuple[str, int]]]:
        """The rows of the table that each row of the file stands for, by machine and index."""
        name = self.subsystem.qualified_name
        return grouped((item, (name, index)) for index, item in enumerate(self._rows))

    def equations(self) -> EquationNumbers:
        """The numbers of all equations that its steps can execute."""
        states, rows = self.subsystem.states, self.subsystem.transitions
        return frozenset[int]().union(
            *map(self._equations.of_state, states),
            *(self._equations.of_condition(c) for s in states for _, c in s.behaviour.endings),
            *map(self._equations.of_row, rows),
        )

    def is_possible(self, passage: Passage) -> bool:
        """Whether there are such states, and such a row between them."""
        before, label, state = passage
        if state not in self._states:
            return False
        if not label:
            return before in ("", state)
        rows, index = self.subsystem.transitions, self._indices.get(label)
        return index is not None and (before, state) == (rows[index].source, rows[index].target)

    def covered(self, passage: Passage) -> tuple[set[CoverageItem], EquationNumbers]:
        """What a step with a possible passage tries: items, and numbers of equations."""
        before, label, state = passage
        index = self._indices[label] if label else -1
        behaviour = self.subsystem.state(state).behaviour
        numbers = self._equations.of_state(self.subsystem.state(state))
        found = {self._states[state]}
        found.update(
            self._functions[f.place] for f in behaviour.functions if f.place in self._functions
        )
        if index >= 0:
            found.add(self._rows[index])
        for condition, truth in self._endings(before, index):
            found.update(self._item_of(condition, truth))
            numbers |= self._equations.of_condition(condition)
        for number, row in self._rows_asked(before, index):
            found.update(self._item_of(row.condition, self._is_taken(row, index)))
            if number <= index:
                numbers |= self._equations.of_row(row)
        return found, numbers

    def _item_of(self, condition: Condition, truth: bool) -> Iterator[CoverageItem]:
        if item := self._conditions.get((condition.name, truth)):
            yield item

    def _endings(self, before: str, index: int) -> Iterator[tuple[Condition, bool]]:
        """The conditions that could end the state before, up to the first one that held."""
        if not before:
            return
        cause = self.subsystem.transitions[index].cause if index >= 0 else ""
        for each, condition in self.subsystem.state(before).behaviour.endings:
            yield condition, each == cause
            if each == cause:
                return

    def _rows_asked(self, before: str, index: int) -> tuple[tuple[int, Transition], ...]:
        """The rows of that state and cause, of which one applied: all others did not."""
        if index < 0:
            return ()
        return self.subsystem.rows(before, self.subsystem.transitions[index].cause)

    def _is_taken(self, row: Transition, index: int) -> bool:
        """Whether the condition of a row held: rows that resume a mode share one."""
        return row.condition.name == self.subsystem.transitions[index].condition.name


def requirement_item(requirement: Requirement) -> CoverageItem:
    """The item of a requirement, which a run tries by asking it."""
    name = requirement.name or requirement.that
    return CoverageItem("requirement", "", name, requirement.place)


def _conditions(subsystem: Subsystem) -> Iterator[Condition]:
    """The conditions that steps ask."""
    for state in subsystem.states:
        yield from (condition for _, condition in state.behaviour.endings)
    yield from (row.condition for row in subsystem.transitions)


def _function_name(function: Function) -> str:
    return function.generic.part.name if function.generic else function.name


def _row_names(subsystem: Subsystem) -> dict[tuple[Place, str], str]:
    """The rows of the file, each with the cause `error` if it stands for several of them."""
    causes: dict[tuple[Place, str], set[str]] = {}
    for row in subsystem.transitions:
        causes.setdefault(row.written, set()).add(row.cause)
    names: dict[tuple[Place, str], str] = {}
    for row in subsystem.transitions:
        cause = cause_words(row.cause) if len(causes[row.written]) == 1 else "error"
        target = f"resume({row.resumes})" if row.resumes else row.target_mode or row.target
        words = row.source_mode or row.source, cause, row.condition.name, "->", target
        names.setdefault(row.written, " ".join(words))
    return names


def equation_places(system: System) -> dict[int, Place]:
    """The first part of a specification that carries each equation number."""
    places: dict[int, Place] = {}
    for part in _traced(system):
        for number in part.trace.eq:
            places.setdefault(number, part.place)
    return places


class _Traced(Protocol):
    @property
    def trace(self) -> Trace: ...
    @property
    def place(self) -> Place: ...


def _traced(system: System) -> Iterator[_Traced]:
    """The parts that carry numbers of equations which a step can execute."""
    for subsystem in system.subsystems:
        yield from subsystem.behaviours
        for function in subsystem.functions:
            yield function
            yield from function.assignments
        yield from subsystem.states
        yield from subsystem.transitions
        yield from subsystem.conditions
        yield from subsystem.lets
        yield from subsystem.memory
        yield from subsystem.inputs.values()
        yield from subsystem.outputs.values()
    yield from system.operators
    yield from system.types
