"""Which inputs have a value where they are read: definite assignment over the state graph."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field

from specc.analysis.connections import Arrivals
from specc.analysis.graph import Step
from specc.analysis.visits import Visits
from specc.frozen import frozen
from specc.model.expr import (
    Choice,
    ConstantRef,
    Expr,
    Fresh,
    Input,
    LetRef,
    Logic,
    Present,
    Unary,
    Unknown,
    children,
    walk,
)
from specc.model.system import Let, Subsystem
from specc.proof import InputName

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


def names_any(expr: Expr, constants: Collection[str]) -> bool:
    """Whether an expression refers to one of some constants or parameters."""
    if not constants:
        return False
    return any(isinstance(node, ConstantRef) and node.name in constants for node in walk(expr))


# Which inputs an expression reads although they may have no value.


Names = frozenset[InputName]
_NONE: Names = frozenset()


@frozen
class Reading:
    """An input that is read, in the text of `let` or, without one, of the expression itself."""

    input: Input
    let: Let | None

    @property
    def name(self) -> InputName:
        """Peer and element."""
        return self.input.peer, self.input.element


@dataclass(slots=True)
class Readings:
    """Follows the expressions of a subsystem; `close` adds what is sent together (see Arrivals)."""

    subsystem: Subsystem
    close: Callable[[Names], Names]
    _lets: dict[str, Let] = field(init=False)
    _everything: Names = field(init=False)
    _told: dict[tuple[str, bool], Names] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._lets = {item.name: item for item in self.subsystem.lets}
        self._everything = frozenset(
            (port.peer, element.name)
            for port in self.subsystem.ports
            if port.direction == "x"
            for element in port.elements
        )

    def unguarded(self, expr: Expr, present: Names) -> Iterator[Reading]:
        """What `expr` may read in vain where only `present` is sure; tests in it are heeded."""
        yield from self._read(expr, present, None, Visits(present))

    def told(self, expr: Expr, holds: bool) -> Names:
        """Inputs that must have a value where a condition holds, or where it does not.

        What is unknown may be about any input.
        """
        match expr:
            case Unknown():
                return self._everything
            case Fresh(input=element) | Present(input=element) if holds:
                return frozenset(((element.peer, element.element),))
            case Unary(op="not", operand=operand):
                return self.told(operand, not holds)
            case Logic(op=op, operands=operands):
                parts = [self.told(part, holds) for part in operands]
                every = (op == "and") == holds
                return _NONE.union(*parts) if every else frozenset.intersection(*parts)
            case Choice(test=test, then=then, otherwise=otherwise):
                one = self.told(test, True) | self.told(then, holds)
                return one & (self.told(test, False) | self.told(otherwise, holds))
            case LetRef(name=name) if name in self._lets:
                key = name, holds
                if key not in self._told:
                    self._told[key] = self.told(self._lets[name].value, holds)
                return self._told[key]
        return _NONE

    def _read(
        self, expr: Expr, present: Names, let: Let | None, seen: Visits[InputName]
    ) -> Iterator[Reading]:
        match expr:
            case Input(peer=peer, element=element):
                if (peer, element) not in present:
                    yield Reading(expr, let)
            case Fresh() | Present():
                pass
            case LetRef(name=name) if name in self._lets:
                known = seen.knowing(name, present)
                if known is not None:
                    inner = self._lets[name]
                    yield from self._read(inner.value, known, inner, seen)
            case Logic(op=op, operands=operands):
                for part in operands:
                    yield from self._read(part, present, let, seen)
                    present = self.close(present | self.told(part, op == "and"))
            case Choice(test=test, then=then, otherwise=otherwise):
                yield from self._read(test, present, let, seen)
                for branch, holds in ((then, True), (otherwise, False)):
                    there = self.close(present | self.told(test, holds))
                    yield from self._read(branch, there, let, seen)
            case _:
                for child in children(expr):
                    yield from self._read(child, present, let, seen)


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
        """In every period but the first, in whatever state: those in which conditions are asked."""
        return self.arrivals.close(self.arrivals.always | self.arrivals.later)

    def in_conditions(self, state: str) -> frozenset[InputName]:
        """In the conditions that end a state; they are first asked one period after it began."""
        return self.arrivals.close(self.in_functions[state] | self.arrivals.later)

    def after(self, step: Step) -> frozenset[InputName]:
        """Once a row was taken."""
        return self.arrivals.close(self.in_conditions(step.row.source) | step.ensures)

    def way_without(self, state: str, element: InputName) -> list[str]:
        """States on a shortest way to `state` on which the element may be missing."""
        steps = self._without(element)
        before: dict[str, str] = {self.initial_state: ""}
        open_ = deque((self.initial_state,))
        while open_ and state not in before:
            here = open_.popleft()
            for step in steps:
                if step.row.source == here and step.row.target not in before:
                    before[step.row.target] = here
                    open_.append(step.row.target)
        way = [state]
        while before.get(way[-1]):
            way.append(before[way[-1]])
        return way[::-1]

    def _without(self, element: InputName) -> list[Step]:
        return [step for step in self.steps if element not in self.after(step)]


def find_presence(subsystem: Subsystem, steps: Sequence[Step], arrivals: Arrivals) -> Presence:
    """The greatest solution of the flow equations; a state never entered has everything.

    So has every state if it is not known where the machine begins.
    """
    everything = frozenset(
        (port.peer, element.name)
        for port in subsystem.ports
        if port.direction == "x"
        for element in port.elements
    )
    sets = {state.name: everything for state in subsystem.states}
    presence = Presence(subsystem.initial_state, arrivals, tuple(steps), sets)
    if not subsystem.begun:
        return presence
    sets[subsystem.initial_state] = presence.in_first_period
    if presence.in_first_period == everything:
        return presence
    leaving: dict[str, list[Step]] = {}
    for step in steps:
        leaving.setdefault(step.row.source, []).append(step)
    open_ = deque((subsystem.initial_state,))
    met = {subsystem.initial_state}
    while open_:
        for step in leaving.get(open_.popleft(), ()):
            target = step.row.target
            present = sets[target] & presence.after(step)
            if present != sets[target] or target not in met:
                sets[target] = present
                met.add(target)
                open_.append(target)
    return presence
