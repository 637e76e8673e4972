"""A cause that can occur in a state has rows; a state without any row is not finished."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.words import ending
from specc.model.fsm import State
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0603, and O0605 where the table says nothing of a state yet."""
    unfinished = set()
    for subsystem in facts.subsystems:
        unfinished |= {state.place for state in facts.dead_ends(subsystem)}
        yield from _unfinished(subsystem, facts.dead_ends(subsystem))
    for decided in facts.decided():
        if decided.verdict.rows or not decided.verdict.decision.possible:
            continue
        state, cause = decided.state, decided.cause
        condition = state.behaviour.terminal if cause == "terminal" else state.behaviour.error
        if state.place in unfinished:
            continue
        yield Diagnostic(
            "E0603",
            f"state `{state.name}` has no row for its {cause} condition",
            state.place,
            f"can end {ending(state.behaviour, cause)}",
            (Related(condition.place, f"the {cause} condition"),),
            f"add a row, e.g. `[{state.name}, {cause}, always, {state.name}]`",
        )


def _unfinished(subsystem: Subsystem, ends: tuple[State, ...]) -> Iterator[Diagnostic]:
    """O0605 for each state without rows, or once if the table is empty."""
    if ends and not subsystem.transitions:
        yield Diagnostic(
            "O0605",
            f"`{subsystem.qualified_name}` has no transitions yet",
            subsystem.place,
            help="add `transitions:` with rows such as "
            f"`[{ends[0].name}, terminal, always, {ends[0].name}]`",
        )
        return
    for state in ends:
        yield Diagnostic(
            "O0605",
            f"no row says what comes after state `{state.name}`",
            state.place,
            f"behaviour `{state.behaviour.name}` can end",
            help=f"add rows such as `[{state.name}, terminal, always, {state.name}]`",
        )
