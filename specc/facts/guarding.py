"""What is known to be there in a state: tests of conditions, as far as memory keeps to them.

A transition is taken in the period in which its conditions held, so what they say is true of the
functions of the next state. After that it stays true of memory that the behaviour does not write.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from specc.facts.needs import Needs, negation
from specc.model.expr import Expr, IsNone, Logic, MemoryRef, Unary
from specc.model.fsm import Cause, State, Transition
from specc.model.system import Subsystem
from specc.model.types import ListOf, OptionalOf, Type

Known = frozenset[Expr]
Implies = Callable[[Sequence[Expr], Expr], bool]
"""Whether a fact follows from conditions that hold in one period."""


@dataclass(slots=True)
class Guarding:
    """The facts of interest that hold in the states of a subsystem."""

    subsystem: Subsystem
    facts: Known
    """Those about the clock are not kept, as it starts anew with every state."""
    implies: Implies
    steps: Sequence[Transition]
    """The rows that may be taken."""
    _needs: Needs = field(init=False)
    _in_functions: dict[str, Known] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._needs = Needs(self.subsystem)
        self.facts = frozenset(f for f in self.facts if not self._needs.sources(f).clock)
        self._settle()

    def in_functions(self, state: str) -> Known:
        """Facts that hold in every period in which the functions of a state are executed."""
        return self._in_functions[state]

    def in_conditions(self, state: State) -> Known:
        """Facts that hold when the conditions that end a state are asked."""
        lasting = {fact for fact in self._in_functions[state.name] if self.outlives(fact, state)}
        return frozenset(lasting) | self._made(state)

    def ended(self, state: State, cause: Cause) -> tuple[Expr, ...]:
        """What is true when a state ends by a cause; the error has priority (2.4)."""
        error = state.behaviour.error.when
        if cause == "error":
            return self.timeless(error)
        return (*self.timeless(state.behaviour.terminal.when), *self.timeless(negation(error)))

    def timeless(self, condition: Expr) -> tuple[Expr, ...]:
        """The parts of a condition that are as true of the next state, whose clock starts anew."""
        parts: tuple[Expr, ...] = (condition,)
        if isinstance(condition, Logic) and condition.op == "and":
            parts = condition.operands
        return tuple(part for part in parts if not self._needs.sources(part).clock)

    def _settle(self) -> None:
        """The greatest solution of the flow equations, from everything downwards."""
        self._in_functions = {state.name: self.facts for state in self.subsystem.states}
        if self.subsystem.initial_state in self._in_functions:
            self._in_functions[self.subsystem.initial_state] = self._at_start()
        ways = self._ways()
        open_ = deque(ways)
        while open_:
            name = open_.popleft()
            for target, conditions in ways[name]:
                before = self._in_functions[target]
                kept = self._kept(before, self.subsystem.state(name), conditions)
                if kept != before:
                    self._in_functions[target] = kept
                    open_.append(target)

    def _ways(self) -> dict[str, list[tuple[str, Sequence[Expr]]]]:
        """State -> the states that it enters, or goes on as, and what is true when it does."""
        found: dict[str, list[tuple[str, Sequence[Expr]]]] = {}
        for state in self.subsystem.states:
            ends = (state.behaviour.terminal.when, state.behaviour.error.when)
            going = [part for end in ends for part in self.timeless(negation(end))]
            found[state.name] = [(state.name, going)]
        for row in self.steps:
            ended = self.ended(self.subsystem.state(row.source), row.cause)
            conditions = (*ended, *self.timeless(row.condition.when))
            found[row.source].append((row.target, conditions))
        return found

    def _kept(self, facts: Known, source: State, conditions: Sequence[Expr]) -> Known:
        """Those of some facts that hold after a state in which the conditions held."""
        known = self.in_conditions(source)
        told = (*conditions, *sorted_(known))
        return frozenset(f for f in facts if f in known or self.implies(told, f))

    def outlives(self, fact: Expr, state: State) -> bool:
        """Whether what is true when a state is entered is so in all its periods."""
        sources = self._needs.sources(fact)
        return sources.lasts and not sources.memory & set(_written(state))

    def _made(self, state: State) -> Known:
        """Facts about memory to which the behaviour assigns what is there by its type."""
        written = _written(state)
        return frozenset(
            fact
            for fact in self.facts
            if (name := _memory_of(fact)) in written and _is_there(fact, written[name])
        )

    def _at_start(self) -> Known:
        initial = {item.name: item.init.type for item in self.subsystem.memory}
        return frozenset(
            fact
            for fact in self.facts
            if (name := _memory_of(fact)) in initial and _is_there(fact, initial[name])
        )


def sorted_(known: Known) -> list[Expr]:
    """Facts in an order that does not depend on the run."""
    return sorted(known, key=repr)


def _written(state: State) -> dict[str, Type]:
    """Memory that a behaviour writes -> the type of what it assigns."""
    assignments = [a for function in state.behaviour.functions for a in function.assignments]
    return {a.name: a.value.type for a in assignments if not a.peer}


def _memory_of(fact: Expr) -> str:
    """The memory element that a fact is about; "" if it is about something else."""
    match fact:
        case Unary(operand=IsNone(value=MemoryRef(name=name))):
            return name
    value = getattr(getattr(fact, "left", None), "args", (None,))[0]
    return value.name if isinstance(value, MemoryRef) else ""


def _is_there(fact: Expr, type_: Type) -> bool:
    """Whether a value of that type is never None, or a list of that type never empty."""
    if isinstance(fact, Unary):
        return not isinstance(type_, OptionalOf)
    return isinstance(type_, ListOf) and type_.nonempty
