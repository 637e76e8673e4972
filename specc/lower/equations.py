"""Equation numbers of what a step can execute, found once, for the report of a run.

A number counts for the thing that carries it and for all that refers to that thing: through lets,
memory, elements of buffers, types and operators.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

from specc.lower.module import elements
from specc.lower.plan import EquationsPlan
from specc.lower.text import literal
from specc.model import expr as e
from specc.model.fsm import Behaviour, Condition
from specc.model.system import Subsystem, System
from specc.model.trace import Trace
from specc.model.types import ListOf, OptionalOf, Record, Type, Vector

Numbers = frozenset[int]
NONE: Numbers = frozenset()


class Equations:
    """Looks equation numbers up in one subsystem."""

    def __init__(self, system: System, subsystem: Subsystem) -> None:
        self._subsystem = subsystem
        self._operators = {o.name: o for o in system.operators}
        self._memory = {m.name: m for m in subsystem.memory}
        self._declared = dict(system.types)
        self._elements = {
            (direction, peer, element.name): element
            for direction in ("x", "y")
            for peer, element in elements(subsystem, direction)
        }
        self._types: dict[Type, Numbers] = {}

    @cached_property
    def _lets(self) -> dict[str, Numbers]:
        found: dict[str, Numbers] = {}
        for let in self._subsystem.lets:
            found[let.name] = _of(let.trace) | self._of_expr(let.value, found)
        return found

    def plan(self) -> EquationsPlan:
        """The tables that a generated class carries."""
        subsystem = self._subsystem
        checks = []
        for state in subsystem.states:
            causes = (("error", state.behaviour.error), ("terminal", state.behaviour.terminal))
            numbers = ((literal(c), self._of_condition(condition)) for c, condition in causes)
            found = [f"{cause}: {_literal(n)}" for cause, n in numbers if n]
            if found:
                checks.append((literal(state.name), f"{{{', '.join(found)}}}"))
        behaviours = (
            (state.name, _of(state.trace) | self._of_behaviour(state.behaviour))
            for state in subsystem.states
        )
        return EquationsPlan(
            behaviours=tuple((literal(name), _literal(n)) for name, n in behaviours if n),
            checks=tuple(checks),
            rows=tuple(
                _literal(_of(row.trace) | self._of_condition(row.condition))
                for row in subsystem.transitions
            ),
        )

    def _of_condition(self, condition: Condition) -> Numbers:
        return _of(condition.trace) | self._of_expr(condition.when, self._lets)

    def _of_behaviour(self, behaviour: Behaviour) -> Numbers:
        numbers = _of(behaviour.trace)
        for function in behaviour.functions:
            numbers |= _of(function.trace)
            for assignment in function.assignments:
                numbers |= _of(assignment.trace) | self._of_expr(assignment.value, self._lets)
                numbers |= self._of_target(assignment.peer, assignment.name)
        return numbers

    def _of_target(self, peer: str, name: str) -> Numbers:
        target = self._elements.get(("y", peer, name)) if peer else self._memory.get(name)
        return _of(target.trace) | self._of_type(target.type) if target else NONE

    def _of_expr(self, expr: e.Expr, lets: dict[str, Numbers]) -> Numbers:
        numbers = NONE
        for node in e.walk(expr):
            numbers |= self._of_type(node.type)
            match node:
                case e.LetRef(name=name):
                    numbers |= lets[name]
                case e.Call(operator=operator):
                    numbers |= _of(self._operators[operator].trace)
                case e.MemoryRef(name=name):
                    numbers |= self._of_target("", name)
                case e.Input(peer=peer, element=element):
                    source = self._elements.get(("x", peer, element))
                    numbers |= _of(source.trace) if source else NONE
        return numbers

    def _of_type(self, type_: Type) -> Numbers:
        if type_ not in self._types:
            numbers = _of(self._declared.get(getattr(type_, "name", None) or "", Trace()))
            self._types[type_] = numbers.union(*map(self._of_type, _parts(type_)))
        return self._types[type_]


def _parts(type_: Type) -> Iterable[Type]:
    match type_:
        case ListOf(element=inner) | Vector(element=inner) | OptionalOf(value=inner):
            return (inner,)
        case Record(fields=fields):
            return (field for _, field in fields)
    return ()


def _of(trace: Trace) -> Numbers:
    return frozenset(trace.eq)


def _literal(numbers: Numbers) -> str:
    return literal(tuple(sorted(numbers)))
