"""What may be None or empty is tested before it is taken for a value or an item."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from specc.diagnostics import Diagnostic, Related
from specc.expr import show
from specc.facts import Facts
from specc.facts.guarding import Guarding, sorted_
from specc.facts.needs import Need, Needs, negation, with_items
from specc.facts.places import text_place
from specc.facts.references import expressions
from specc.model.expr import Expr, Sure, Truth, has_unknown, walk
from specc.model.fsm import Condition, State
from specc.model.system import Subsystem, System
from specc.model.types import OptionalOf
from specc.proof import Moment
from specc.source import Place


@dataclass(frozen=True, slots=True)
class _Use:
    """An expression in the text at `key` of a part, and what is known where it is evaluated."""

    expr: Expr
    part: Place
    key: str
    what: str
    known: tuple[Expr, ...] = ()
    state: State | None = None
    moment: Moment = "start"


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
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
    error, terminal = state.behaviour.error, state.behaviour.terminal

    def use(condition: Condition, *before: Expr) -> _Use:
        what = f"condition `{condition.name}`"
        asked = (*known, *before)
        return _Use(condition.when, condition.place, "when", what, asked, state, "conditions")

    yield use(error)
    going = negation(error.when)
    yield use(terminal, going)
    for row in guarding.steps:
        if row.source == state.name and row.cause == "terminal":
            yield use(row.condition, going, terminal.when)
        elif row.source == state.name:
            yield use(row.condition, error.when)


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
        f"`{text}` {lacking}{where}, where {use.what} takes it for granted",
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
