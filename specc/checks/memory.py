"""Memory that is read, written and reset."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from specc.analysis import Facts, Machine
from specc.analysis.graph import RowEdge
from specc.diagnostics import Diagnostic, Related, first_at_each_place
from specc.lang import show
from specc.lang.builtins import FUNCTIONS
from specc.model.expr import (
    JOINED,
    MIRRORED,
    TRUE,
    Binary,
    Builtin,
    Choice,
    Compare,
    Expr,
    MemoryRef,
    children,
    negation,
)
from specc.model.fsm import Condition, State
from specc.model.system import Memory
from specc.model.types import ListOf
from specc.reachable import reachable

# What functions make of a counter: it stays, or counts up; anything else may set it back.


def _increments(machine: Machine, value: Expr, counter: str) -> bool | None:
    """Whether a value increments memory; False if it is that memory, None if it is another."""
    numbering = machine.prover.numbering
    match numbering.resolve(value):
        case MemoryRef(name=name) if name == counter:
            return False
        case Binary(op="+", left=left, right=right):
            for one, other in ((left, right), (right, left)):
                if (step := numbering.constant_number(other)) is not None and step > 0:
                    return None if _increments(machine, one, counter) is None else True
        case Choice(then=then, otherwise=otherwise):
            branches = [_increments(machine, branch, counter) for branch in (then, otherwise)]
            return None if None in branches else any(branches)
        case Builtin(name=name, args=args) if FUNCTIONS[name].picks:  # it stops at a number
            unknown = [arg for arg in args if numbering.constant_number(arg) is None]
            return _increments(machine, unknown[0], counter) if len(unknown) == 1 else None
    return None


def _counting_of_memory(machine: Machine, state: State) -> dict[str, bool | None]:
    """Memory that a state assigns: True if incremented, False if unchanged, else None."""
    found: dict[str, bool | None] = {}
    for item in state.behaviour.assignments:
        if not item.peer:
            found[item.name] = _increments(machine, item.value, item.name)
    return found


# A limit of a counter, and what it decides in a state.


@dataclass(frozen=True, slots=True)
class _Limit:
    condition: Condition
    reached: Expr
    """The counter is not below the limit."""


def _limits(machine: Machine, state: State, counter: str) -> Iterator[_Limit]:
    """The limits that conditions of a state set to a counter, directly or through lets."""
    through = machine.prover.numbering.resolve
    behaviour = state.behaviour
    rows = [row for row in machine.subsystem.transitions if row.source == state.name]
    ends = (condition for _, condition in behaviour.endings)
    for condition in (*ends, *(row.condition for row in rows)):
        parts = reachable([through(condition.when)], lambda part: map(through, children(part)))
        for part in parts:
            if isinstance(part, Compare) and (reached := _reached(machine, part, counter)):
                yield _Limit(condition, reached)


def _reached(machine: Machine, comparison: Compare, counter: str) -> Expr | None:
    """The condition that a counter has reached a constant limit."""
    through = machine.prover.numbering.resolve
    sides = (
        (comparison.left, comparison.right, comparison.op),
        (comparison.right, comparison.left, MIRRORED[comparison.op]),
    )
    for memory, limit, op in sides:
        counted, on = through(memory), machine.dependences.of(limit)
        is_counter = isinstance(counted, MemoryRef) and counted.name == counter
        if is_counter and on.is_stable and not on.memory:
            return Compare(">" if op in (">", "<=") else ">=", counted, limit, type=comparison.type)
    return None


# A way from a state back into it on which its counter has reached the limit and is not set back.


def _way_back(machine: Machine, state: State, counter: str, reached: Expr) -> RowEdge | None:
    """The row by which the counter ends a state that is then entered again."""
    counts = {
        s.name: _counting_of_memory(machine, s).get(counter, False)
        for s in machine.subsystem.states
    }

    def following(step: RowEdge) -> list[RowEdge]:
        name = step.row.target
        if name == state.name or counts[name] is None:
            return []
        return [s for s in machine.successors.get(name, ()) if _is_taken(machine, s, reached)]

    for first in machine.successors.get(state.name, ()):
        row = first.row
        depends_on = machine.dependences.all(
            [state.behaviour.ending(row.cause).when, row.condition.when]
        )
        leaves = row.target != state.name and counter in depends_on.memory
        if leaves and _is_taken(machine, first, reached):
            found = reachable([first], following)
            if any(step.row.target == state.name for step in found):
                return first
    return None


def _is_taken(machine: Machine, step: RowEdge, reached: Expr) -> bool:
    """Whether a row may be taken while the counter has reached the limit."""
    behaviour = machine.subsystem.state(step.row.source).behaviour
    ended = [w if holds else negation(w) for w, holds in behaviour.facts_after(step.row.cause)]
    conditions = [*ended, step.row.condition.when, reached]
    return machine.prover.satisfiable(conditions) is True


def counters_set_back(facts: Facts) -> Iterator[Diagnostic]:
    """W0620, once for each counter."""
    machines = facts.complete_machines
    return first_at_each_place(d for m in machines for d in _not_reset(m))


def _not_reset(machine: Machine) -> Iterator[Diagnostic]:
    for state in machine.subsystem.states:
        for counter in (
            name for name, counts in _counting_of_memory(machine, state).items() if counts
        ):
            for limit in _limits(machine, state, counter):
                way = _way_back(machine, state, counter, limit.reached)
                if way is not None:
                    memory = next(item for item in machine.subsystem.memory if item.name == counter)
                    words = "the state is left, and nothing sets the counter back"
                    left = Related(way.row.place, words)
                    yield Diagnostic(
                        "W0620",
                        f"`{show(limit.reached)}` still holds when state `{state.name}` is "
                        "entered again",
                        memory.place,
                        "counts on",
                        (Related(limit.condition.place, f"asks for `{counter}`"), left),
                        f"set `{counter}` back in a state on that way",
                    )
                    break


# A list does not grow for ever.


def lists_end(facts: Facts) -> Iterator[Diagnostic]:
    """W0621: memory to which functions only append."""
    return first_at_each_place(
        Diagnostic(
            "W0621",
            f"list `{item.name}` only grows",
            item.place,
            "every function that writes it appends to it",
            help="begin it anew where a state is entered, or keep a bounded part of it",
        )
        for machine in facts.complete_machines
        for item in machine.subsystem.memory
        if isinstance(item.type, ListOf) and _only_grows(machine, item)
    )


def _only_grows(machine: Machine, item: Memory) -> bool:
    """Whether functions only append to memory, again and again, and no condition reads it."""
    through, subsystem = machine.prover.numbering.resolve, machine.subsystem
    written = subsystem.assigned_values.get(("", item.name), {})
    values = [through(value) for each in written.values() for value in each]
    read = machine.dependences.all(condition.when for condition in subsystem.exit_conditions)
    if not values or item.name in read.memory:
        return False
    if not any(
        state.behaviour.name in written
        and (state.behaviour.terminal.when != TRUE or machine.is_on_cycle(state.name))
        for state in subsystem.states
    ):
        return False
    memory = MemoryRef(item.name, type=item.type)
    return all(
        isinstance(value, Builtin) and value.name == JOINED and through(value.args[0]) == memory
        for value in values
    )
