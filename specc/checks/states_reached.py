"""Every state can be reached from the initial one."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.model.fsm import State, Transition
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0607, once for unreached states that hang together."""
    for subsystem in facts.consistent_subsystems:
        reached = facts.reached(subsystem)
        for group in _groups(subsystem, reached):
            yield _finding(subsystem, group, reached)


def _groups(subsystem: Subsystem, reached: frozenset[str]) -> list[list[State]]:
    """The unreached states, those together that rows connect."""
    left = [s for s in subsystem.states if s.name not in reached]
    groups: list[list[State]] = []
    while left:
        names, size = {left[0].name}, 0
        while len(names) > size:
            size = len(names)
            for row in subsystem.transitions:
                if {row.source, row.target} & names:
                    names |= {row.source, row.target} - reached
        groups.append([s for s in left if s.name in names])
        left = [s for s in left if s.name not in names]
    return groups


def _finding(subsystem: Subsystem, group: list[State], reached: frozenset[str]) -> Diagnostic:
    names = [state.name for state in group]
    dead = [r for r in subsystem.transitions if r.target in names and r.source in reached]
    what = "state " if len(names) == 1 else "states "
    return Diagnostic(
        "W0607",
        f"{what}{', '.join(f'`{n}`' for n in names)} cannot be reached from "
        f"`{subsystem.initial_state}`",
        group[0].place,
        "never entered",
        tuple(Related(row.place, "this row can never be taken") for row in dead),
        _way_out(names, dead),
    )


def _way_out(names: list[str], dead: list[Transition]) -> str:
    if dead:
        return "make the condition of the row possible, or delete what is not needed"
    return f"add a row that leads to `{names[0]}`, or delete what is not needed"
