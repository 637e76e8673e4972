"""Which inputs have a value where they are read: definite assignment over the state graph."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import NamedTuple

from specc.analysis.connections import Arrivals
from specc.analysis.graph import Step
from specc.analysis.guards import Guards, Implied
from specc.frozen import frozen
from specc.model.expr import ConstantRef, Expr, Fresh, Input, Present, Unknown, walk
from specc.model.system import Let, Subsystem
from specc.proof import InputName
from specc.reachable import fixpoint, grouped, shortest

# What the expressions of a subsystem refer to.


def expressions(subsystem: Subsystem) -> Iterator[Expr]:
    """Every expression of a subsystem, parameters and initial values included."""
    for port in subsystem.ports:
        yield from (e.init for e in port.elements if e.init is not None)
    yield from (constant.value for constant in subsystem.constants)
    yield from (memory.init for memory in subsystem.memory)
    yield from (item.value for item in subsystem.lets)
    yield from (condition.when for condition in subsystem.conditions)
    yield from (a.value for f in subsystem.functions for a in f.assignments)
    yield from (axiom.that for axiom in subsystem.axioms)


def inputs_read(subsystem: Subsystem) -> frozenset[InputName]:
    """Inputs whose value or arrival some expression asks for."""
    return frozenset(
        (node.peer, node.element)
        for expression in expressions(subsystem)
        for node in walk(expression)
        if isinstance(node, Input)
    )


def arrivals_asked(subsystem: Subsystem) -> frozenset[InputName]:
    """Inputs of which it matters whether a new value has come."""
    return frozenset(
        (node.input.peer, node.input.element)
        for expression in expressions(subsystem)
        for node in walk(expression)
        if isinstance(node, Fresh)
    )


def all_inputs(subsystem: Subsystem) -> frozenset[InputName]:
    """Every element of the input buffers."""
    return frozenset(
        (port.peer, element.name)
        for port in subsystem.ports
        if port.direction == "x"
        for element in port.elements
    )


def names_any(expr: Expr, constants: Collection[str]) -> bool:
    """Whether an expression refers to one of some constants or parameters."""
    if not constants:
        return False
    return any(isinstance(node, ConstantRef) and node.name in constants for node in walk(expr))


# Which inputs an expression reads although they may have no value.


Names = frozenset[InputName]
_NONE: Names = frozenset()


class Reading(NamedTuple):
    """An input that is read, in the text of `let` or, without one, of the expression itself."""

    input: Input
    let: Let | None

    @property
    def name(self) -> InputName:
        """Peer and element."""
        return self.input.peer, self.input.element


class Readings:
    """Follows the expressions of a subsystem; `close` adds what is sent together (see Arrivals)."""

    def __init__(self, subsystem: Subsystem, close: Callable[[Names], Names]) -> None:
        lets = {item.name: item for item in subsystem.lets}
        self.close = close
        self.told = Implied(lets, self._told).by
        """Inputs that must have a value where a condition holds, or where it does not."""
        self._guards = Guards(lets, self.behind)
        self._everything = all_inputs(subsystem)

    def unguarded(self, expr: Expr, present: Names) -> Iterator[Reading]:
        """What `expr` may read without a value where only `present` is sure; tests in it count."""
        for part, known, let in self._guards.parts(expr, present):
            if isinstance(part, Input) and (part.peer, part.element) not in known:
                yield Reading(part, let)

    def _told(self, expr: Expr, holds: bool) -> Names:
        """What is unknown may be about any input."""
        match expr:
            case Unknown():
                return self._everything
            case Fresh(input=element) | Present(input=element) if holds:
                return frozenset(((element.peer, element.element),))
        return _NONE

    def behind(self, present: Names, test: Expr, holds: bool) -> Names:
        """What is present after a test that held, or did not."""
        return self.close(present | self.told(test, holds))


# Definite presence: which inputs surely have a value in a state, on every way into it.
#
# As a Java compiler follows definite assignment: a set per state, intersected over the rows that
# lead there. A value that has arrived stays, so the sets only grow along a way.


@frozen
class Presence:
    """Inputs of a subsystem that surely have a value, by state."""

    initial_state: str
    arrivals: Arrivals
    steps: tuple[Step, ...]
    in_functions: dict[str, frozenset[InputName]]
    """In the functions of a state, from its first period on."""

    @property
    def in_first_period(self) -> frozenset[InputName]:
        """In the first period of all."""
        return self.arrivals.close(self.arrivals.always)

    @property
    def in_later_periods(self) -> frozenset[InputName]:
        """In every period after the first, in any state: when conditions are evaluated."""
        return self.arrivals.close(self.arrivals.always | self.arrivals.later)

    def in_conditions(self, state: str) -> frozenset[InputName]:
        """In the conditions that end a state; they are first asked one period after it began."""
        return self.arrivals.close(self.in_functions[state] | self.arrivals.later)

    def after(self, step: Step) -> frozenset[InputName]:
        """Once a row was taken."""
        return self.arrivals.close(self.in_conditions(step.row.source) | step.ensures)

    def way_without(self, state: str, element: InputName) -> list[str]:
        """States on a shortest way to `state` on which the element may be missing."""
        leaving = grouped((s.row.source, s.row.target) for s in self._without(element))
        return shortest(self.initial_state, state, lambda here: leaving.get(here, ()))

    def _without(self, element: InputName) -> list[Step]:
        return [step for step in self.steps if element not in self.after(step)]


def find_presence(subsystem: Subsystem, steps: Sequence[Step], arrivals: Arrivals) -> Presence:
    """The greatest solution of the flow equations; a state never entered has everything.

    So has every state if it is not known where the machine begins.
    """
    everything = all_inputs(subsystem)
    sets = {state.name: everything for state in subsystem.states}
    presence = Presence(subsystem.initial_state, arrivals, tuple(steps), sets)
    if not subsystem.begun:
        return presence
    sets[subsystem.initial_state] = presence.in_first_period
    if presence.in_first_period == everything:
        return presence
    leaving = grouped((step.row.source, step) for step in steps)

    def narrow(state: str) -> Iterator[str]:
        for step in leaving.get(state, ()):
            target = step.row.target
            present = sets[target] & presence.after(step)
            if present != sets[target]:
                sets[target] = present
                yield target

    fixpoint(sets, narrow)
    return presence
