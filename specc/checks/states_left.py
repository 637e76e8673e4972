"""No state holds its machine for ever unless the specification says so with `never`."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.graph import Component, all_lead_to, components
from specc.facts.words import listed
from specc.model.fsm import State
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0612, once for states that only lead to one another."""
    for subsystem in facts.whole_subsystems:
        if not facts.ways_are_known(subsystem):
            continue
        edges = [(step.row.source, step.row.target) for step in facts.steps(subsystem)]
        reached = facts.reached(subsystem)
        if all_lead_to(subsystem.initial_state, edges, reached):
            continue
        names = [state.name for state in subsystem.states if state.name in reached]
        found = components(names, edges)
        cycles = [part for part in found if len(part.states) > 1]
        for part in found:
            if not part.left and _is_trap(part, cycles, set(edges), subsystem):
                yield _finding(subsystem, part)


def _is_trap(
    part: Component,
    cycles: list[Component],
    edges: set[tuple[str, str]],
    subsystem: Subsystem,
) -> bool:
    """Several states are a trap if other states form a cycle, which is then given up for ever.

    Otherwise the others are the steps that lead to the work. A single state is the end if nothing
    ends it.
    """
    first = part.states[0]
    if len(part.states) > 1:
        return len(cycles) > 1
    return (first, first) in edges


def _finding(subsystem: Subsystem, part: Component) -> Diagnostic:
    states = {state.name: state for state in subsystem.states}
    rows = [row for row in subsystem.transitions if row.source in part.states]
    one = len(part.states) == 1
    named = listed([f"`{name}`" for name in part.states], "and")
    return Diagnostic(
        "W0612",
        f"state {named} is never left" if one else f"states {named} are never left",
        states[part.states[0]].place,
        "once entered, entered for ever",
        tuple(Related(row.place, "leads nowhere else") for row in rows[:4]),
        _way_out(states[part.states[0]], one),
    )


def _way_out(state: State, one: bool) -> str:
    if one:
        return (
            f"add a row that leads on, or say that `{state.name}` is the end by a behaviour with "
            "`terminal: never`"
        )
    return "add a row that leads back to the other states"
