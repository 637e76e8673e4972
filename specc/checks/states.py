"""States that can be reached, left and ended."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from specc.analysis import Facts, Machine
from specc.analysis.graph import StrongComponent, all_lead_to, components
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.model.fsm import State
from specc.model.system import Subsystem
from specc.reachable import grouped, reachable

# A state whose behaviour has a terminal condition can be ended by it.


def states_end(facts: Facts) -> Iterator[Diagnostic]:
    """W0614.

    Where there are rows, they are `rows_can_apply`'s matter; a condition that never holds at all
    is `conditions_vary`'s.
    """
    for machine in facts.complete_machines:
        for state in machine.subsystem.states:
            verdict = machine.verdict(state.name, "terminal")
            if verdict.rows or verdict.decision.possible:
                continue
            condition, error = state.behaviour.terminal, state.behaviour.error
            if machine.prover.constant(condition.when) is not False:
                yield Diagnostic(
                    "W0614",
                    f"state `{state.name}` never ends by its terminal condition `{condition.name}`",
                    state.place,
                    f"the error condition `{error.name}` holds whenever the terminal one does",
                    (Related(condition.place, "the terminal condition"),),
                    "write `terminal: never` if that is meant, or change a condition",
                )


# Every state can be reached from the initial one.


def states_reached(facts: Facts) -> Iterator[Diagnostic]:
    """W0607, once for each group of connected states, where the others are reached from."""
    for machine in facts.machines:
        if machine.is_finished:
            states = (state.name for state in machine.subsystem.states)
            left = [name for name in states if name not in machine.reachable_states]
            yield from _findings(machine, left) if left else ()


def _findings(machine: Machine, left: list[str]) -> Iterator[Diagnostic]:
    """Of the components of the unreached states, those that no other one leads to."""
    subsystem = machine.subsystem
    edges = [(row.source, row.target) for row in subsystem.transitions]
    order = {name: index for index, name in enumerate(left)}
    targets = grouped(edge for edge in edges if edge[1] in order)
    entering = grouped(
        (row.target, (index, row))
        for index, row in enumerate(subsystem.transitions)
        if row.source in machine.reachable_states
    )
    senders = _senders(subsystem)
    told: set[str] = set()
    for part in components(left, edges):
        ways_in = sorted(way for name in part.states for way in entering.get(name, ()))
        dead = [row for _, row in ways_in]
        if (part.has_entry and not dead) or told.issuperset(part.states):
            continue
        following = partial(_untold, targets, told)
        behind = sorted(reachable(part.states[:1], following), key=order.__getitem__)
        told.update(behind)
        never = [
            Related(row.place, _never_taken(machine.dwell_times.excludes_row(row))) for row in dead
        ]
        lost = _unsent(subsystem, behind, senders)
        yield _not_reached(subsystem, part.states, behind, never, lost)


def _untold(targets: dict[str, list[str]], told: set[str], state: str) -> list[str]:
    return [target for target in targets.get(state, ()) if target not in told]


def _senders(subsystem: Subsystem) -> dict[str, set[str]]:
    """The states that send each element."""
    found: dict[str, set[str]] = {}
    for state in subsystem.states:
        for item in state.behaviour.assignments:
            if item.peer:
                found.setdefault(item.target, set()).add(state.name)
    return found


def _not_reached(
    subsystem: Subsystem,
    first: tuple[str, ...],
    group: list[str],
    dead: list[Related],
    lost: Iterable[Related],
) -> Diagnostic:
    named = ", ".join(f"`{name}`" for name in group)
    through = f", `{first[0]}` would have to be entered first" if len(group) > 1 else ""
    return Diagnostic(
        "W0607",
        f"{'state' if len(group) == 1 else 'states'} {named} cannot be reached from "
        f"`{subsystem.initial_state}`",
        subsystem.state(first[0]).place,
        f"never entered{through}",
        (*dead, *lost),
        _way_in(first[0], dead),
    )


def _unsent(
    subsystem: Subsystem, group: list[str], senders: dict[str, set[str]]
) -> Iterator[Related]:
    """The elements that only these states send."""
    inside = set(group)
    sent = (a for name in group for a in subsystem.state(name).behaviour.assignments if a.peer)
    lost = {a.target: a for a in sent if senders[a.target] <= inside}
    return (Related(a.place, f"so `{a.target}` is never sent") for a in lost.values())


def _never_taken(excluded: bool) -> str:
    return f"this row can never be taken{': the times rule it out' if excluded else ''}"


def _way_in(name: str, dead: list[Related]) -> str:
    if dead:
        return "make the condition of the row possible, or delete what is not needed"
    return f"add a row that leads to `{name}`, or delete what is not needed"


# No state holds its machine for ever unless the specification says so with `never`.


def states_left(facts: Facts) -> Iterator[Diagnostic]:
    """W0612, once for states that only lead to one another."""
    for machine in facts.complete_machines:
        if not machine.has_known_edges:
            continue
        subsystem, reached = machine.subsystem, machine.reachable_states
        edges = [(step.row.source, step.row.target) for step in machine.edges]
        if all_lead_to(subsystem.initial_state, edges, reached):
            continue
        names = [state.name for state in subsystem.states if state.name in reached]
        found = components(names, edges)
        cycles = [part for part in found if len(part.states) > 1]
        for part in found:
            if not part.has_exit and _is_trap(part, cycles, set(edges)):
                yield _not_left(subsystem, part)


def _is_trap(
    part: StrongComponent[str], cycles: list[StrongComponent[str]], edges: set[tuple[str, str]]
) -> bool:
    """Several states are a trap if other states form a cycle, which is then left for good.

    Otherwise the others are the steps that lead to the work. A single state is the end if nothing
    ends it.
    """
    first = part.states[0]
    if len(part.states) > 1:
        return len(cycles) > 1
    return (first, first) in edges


def _not_left(subsystem: Subsystem, part: StrongComponent[str]) -> Diagnostic:
    states = {state.name: state for state in subsystem.states}
    rows = [row for row in subsystem.transitions if row.source in part.states]
    one = len(part.states) == 1
    named = join_words([f"`{name}`" for name in part.states], "and")
    return Diagnostic(
        "W0612",
        f"{'state' if one else 'states'} {named} cannot be left once entered",
        states[part.states[0]].place,
        "no row leads out",
        tuple(Related(row.place, "does not lead out") for row in rows[:4]),
        _way_out(states[part.states[0]], one),
    )


def _way_out(state: State, one: bool) -> str:
    if one:
        return (
            f"add a row that leads on, or make `{state.name}` an intended end with a behaviour "
            "that has `terminal: never`"
        )
    return "add a row that leads back to the other states"


CHECKS = (states_end, states_reached, states_left)
