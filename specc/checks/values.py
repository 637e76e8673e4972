"""Values that may be None, lists that may be empty: read only behind a guard."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

from specc.analysis import Facts
from specc.analysis.guards import asked, ended, negation, said
from specc.analysis.needs import Need, Needs, with_items
from specc.analysis.presence import expressions
from specc.analysis.words import text_place
from specc.diagnostics import Diagnostic, Related
from specc.frozen import frozen
from specc.lang import show
from specc.model.expr import Expr, IsNone, Logic, MemoryRef, Sure, Truth, Unary, has_unknown, walk
from specc.model.fsm import Cause, State, Transition
from specc.model.system import Subsystem, System
from specc.model.types import ListOf, OptionalOf, Type
from specc.proof import Moment
from specc.reachable import fixpoint
from specc.source import Place

# What is known to be there in a state: tests of conditions, as far as memory keeps to them.
#
# A transition is taken in the period in which its conditions held, so what they say is true of the
# functions of the next state. After that it stays true of memory that the behaviour does not write.


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
        """What is true of the next state when one ends by a cause."""
        tests = said(ended(state.behaviour.error, state.behaviour.terminal, cause))
        return tuple(part for test in tests for part in self.timeless(test))

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

        def narrow(name: str) -> Iterator[str]:
            for target, conditions in ways[name]:
                before = self._in_functions[target]
                kept = self._kept(before, self.subsystem.state(name), conditions)
                if kept != before:
                    self._in_functions[target] = kept
                    yield target

        fixpoint(ways, narrow)

    def _ways(self) -> dict[str, list[tuple[str, Sequence[Expr]]]]:
        """State -> the states that it enters, or goes on as, and what is true when it does."""
        found: dict[str, list[tuple[str, Sequence[Expr]]]] = {}
        for state in self.subsystem.states:
            ends = (state.behaviour.terminal.when, state.behaviour.error.when)
            going = [part for end in ends for part in self.timeless(negation(end))]
            found[state.name] = [(state.name, going)]
        for row in self.steps:
            before = self.ended(self.subsystem.state(row.source), row.cause)
            conditions = (*before, *self.timeless(row.condition.when))
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


# What may be None or empty is tested before its value or an item is used.


@frozen
class _Use:
    """An expression in the text at `key` of a part, and what is known where it is evaluated."""

    expr: Expr
    part: Place
    key: str
    what: str
    known: tuple[Expr, ...] = ()
    state: State | None = None
    moment: Moment = "start"


def values_there(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0705."""
    for subsystem in facts.known_machines:
        if any(isinstance(node, Sure) for expr in expressions(subsystem) for node in walk(expr)):
            yield from _findings(subsystem, facts)


def _findings(subsystem: Subsystem, facts: Facts) -> Iterator[Diagnostic]:
    needs, told = Needs(subsystem), set[Place]()
    prover = facts.prover(subsystem)
    guarding = _guarding(subsystem, facts, needs)
    for use in _uses(subsystem, guarding):
        for need in needs.of(use.expr):
            place = _place(need, use)
            context = (*use.known, *need.guards)
            if place in told or need.fact in context or any(map(has_unknown, need.guards)):
                continue
            if not prover.implies(with_items(context), need.fact, use.moment):
                told.add(place)
                yield _finding(need, use, place, guarding)


def _guarding(subsystem: Subsystem, facts: Facts, needs: Needs) -> Guarding:
    """What is known in the states of a subsystem of all that its expressions need."""
    prover = facts.prover(subsystem)
    wanted = {n.fact for e in expressions(subsystem) for n in needs.of(e)}

    def implies(context: Sequence[Expr], fact: Expr) -> bool:
        return prover.implies(with_items(context), fact) is True

    rows = [step.row for step in facts.steps(subsystem)]
    return Guarding(subsystem, frozenset(wanted), implies, rows)


def _uses(subsystem: Subsystem, guarding: Guarding) -> Iterator[_Use]:
    for memory in subsystem.memory:
        yield _Use(memory.init, memory.place, "init", f"memory element `{memory.name}`")
    for index, axiom in enumerate(subsystem.axioms):
        yield _Use(axiom.that, axiom.place, "", f"assumption {index + 1}")
    for state in subsystem.states:
        known = tuple(sorted_(guarding.in_functions(state.name)))
        moment: Moment = "start" if state.name == subsystem.initial_state else "functions"
        for function in state.behaviour.functions:
            for item in function.assignments:
                what = f"function `{function.name}`"
                yield _Use(item.value, item.place, "is", what, known, state, moment)
        yield from _conditions(state, subsystem, guarding)


def _conditions(state: State, subsystem: Subsystem, guarding: Guarding) -> Iterator[_Use]:
    """The conditions that may end a state, each with what is known when it is asked."""
    known = tuple(sorted_(guarding.in_conditions(state)))
    rows = [row for row in guarding.steps if row.source == state.name]
    for tests, conditions in asked(state, rows):
        context = (*known, *said(tests))
        for condition in conditions:
            what = f"condition `{condition.name}`"
            yield _Use(condition.when, condition.place, "when", what, context, state, "conditions")


def _place(need: Need, use: _Use) -> Place:
    if need.let is not None:
        return text_place(need.let.place, "is", need.sure)
    if not use.key:
        start, end = need.sure.span
        return Place(use.part.file, use.part.route, "value", start, end)
    return text_place(use.part, use.key, need.sure)


def _finding(need: Need, use: _Use, place: Place, guarding: Guarding) -> Diagnostic:
    text = show(need.sure.value)
    optional = isinstance(need.sure.value.type, OptionalOf)
    lacking = "may be None" if optional else "may be empty"
    where = f" in state `{use.state.name}`" if use.state else ""
    related: tuple[Related, ...] = ()
    if need.let is not None:
        related = (Related(use.part, f"{use.what} refers to it{where}"),)
    test = show(need.fact) if optional else f"len({text}) > 0"
    enter = ""
    if use.state and _tells(need.fact, use.state, use.moment, guarding):
        enter = f"enter `{use.state.name}` only by rows whose conditions imply `{test}`, or "
    return Diagnostic(
        "E0705",
        f"`{text}` {lacking}{where}, where {use.what} needs a value",
        place,
        "",
        related,
        f"{enter}write `... if {test} else ...`",
    )


def _tells(fact: Expr, state: State, moment: Moment, guarding: Guarding) -> bool:
    """Whether tests on the ways into a state would say enough of a value that it uses."""
    if state.name == guarding.subsystem.initial_state:
        return False
    terminal = state.behaviour.terminal.when
    once = isinstance(terminal, Truth) and terminal.value
    return guarding.outlives(fact, state) or (moment == "functions" and once)


CHECKS = (values_there,)
