"""Conditions that are the same under two names, and lists that only grow."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts, Machine
from specc.diagnostics import Diagnostic, Related
from specc.model.expr import JOINED, TRUE, Builtin, MemoryRef
from specc.model.fsm import Condition
from specc.model.system import Memory
from specc.model.types import ListOf
from specc.reachable import reachable
from specc.source import Place

# Two timers of the same length may well be meant; the same answer about the same values is not.


def conditions_differ(facts: Facts) -> Iterator[Diagnostic]:
    """W0622: two declared conditions of one kind are not the same."""
    seen = set[Place]()
    for machine in facts.complete_machines:
        for one, other in machine.results_of(_same_conditions):
            if other.place not in seen:
                seen.add(other.place)
                yield Diagnostic(
                    "W0622",
                    f"{other.kind} conditions `{one.name}` and `{other.name}` are the same",
                    other.place,
                    "it holds exactly where the other one does",
                    (Related(one.place, f"`{one.name}`"),),
                    "correct one of them, or use one name",
                )


def _same_conditions(machine: Machine) -> Iterator[tuple[Condition, Condition]]:
    first = dict[tuple[str, int, frozenset[str]], Condition]()
    for condition in machine.subsystem.conditions:
        if condition.place.route[-3:-1] != ("conditions", condition.kind):
            continue  # it stands in its behaviour, and is used nowhere else
        on = machine.dependences.of(condition.when)
        if on.inputs or on.memory:
            number = machine.prover.numbering.number(condition.when)
            key = condition.kind, number, on.constants  # two constants may get other values
            earlier = first.setdefault(key, condition)
            if earlier is not condition:
                yield earlier, condition


def lists_end(facts: Facts) -> Iterator[Diagnostic]:
    """W0621: memory to which functions only append."""
    seen = set[Place]()
    for machine in facts.complete_machines:
        for item in machine.subsystem.memory:
            if _only_grows(machine, item) and item.place not in seen:
                seen.add(item.place)
                yield Diagnostic(
                    "W0621",
                    f"list `{item.name}` only grows",
                    item.place,
                    "every function that writes it appends to it",
                    help="begin it anew where a state is entered, or keep a bounded part of it",
                )


def _only_grows(machine: Machine, item: Memory) -> bool:
    """Whether functions only append to memory, and no condition could stop them."""
    numbering, subsystem = machine.prover.numbering, machine.subsystem
    if not isinstance(item.type, ListOf):
        return False
    asked = machine.dependences.all(condition.when for condition in subsystem.exit_conditions)
    written = subsystem.written.get(("", item.name), {})
    values = [numbering.resolve(value) for each in written.values() for value in each]
    again = any(
        ("", item.name) in {(a.peer, a.name) for a in state.behaviour.assignments}
        and (state.behaviour.terminal.when != TRUE or _is_entered_again(machine, state.name))
        for state in subsystem.states
    )
    return (
        bool(values)
        and again
        and item.name not in asked.memory
        and all(
            isinstance(value, Builtin)
            and value.name == JOINED
            and numbering.resolve(value.args[0]) == MemoryRef(item.name, type=item.type)
            for value in values
        )
    )


def _is_entered_again(machine: Machine, state: str) -> bool:
    """Whether a way leads from a state back to it."""
    first = [step.row.target for step in machine.leaving.get(state, ())]

    def following(name: str) -> list[str]:
        return [step.row.target for step in machine.leaving.get(name, ())]

    return state in reachable(first, following)


CHECKS = (conditions_differ, lists_end)
