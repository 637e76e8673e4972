"""A cause that can occur in a state has rows; a state without any row is not finished."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Decided, Facts
from specc.facts.examples import Examples
from specc.facts.words import ending
from specc.model.fsm import State
from specc.model.system import Subsystem, System
from specc.proof import Witness


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0603, and O0605 where the table says nothing of a state yet."""
    unmet = [decided for decided in facts.decided() if facts.lacks_rows(decided)]
    for subsystem in facts.subsystems:
        sources = {row.source for row in subsystem.transitions}
        without = {
            decided.state.place
            for decided in unmet
            if decided.subsystem is subsystem and decided.state.name not in sources
        }
        yield from _unfinished(subsystem, [s for s in subsystem.states if s.place in without])
    examples = Examples(facts)
    for decided in unmet:
        if any(row.source == decided.state.name for row in decided.subsystem.transitions):
            yield _no_row(decided, examples)


def _no_row(decided: Decided, examples: Examples) -> Diagnostic:
    state, cause = decided.state, decided.cause
    condition = state.behaviour.terminal if cause == "terminal" else state.behaviour.error
    ended = Witness((), answers=((condition.when, True),))
    return Diagnostic(
        "E0603",
        f"state `{state.name}` has no row for its {cause} condition",
        state.place,
        f"can end {ending(state.behaviour, cause)}",
        (Related(condition.place, f"the {cause} condition"),),
        f"add a row, e.g. `[{state.name}, {cause}, always, {state.name}]`",
        example=examples.text(decided.subsystem, state, cause, ended),
    )


def _unfinished(subsystem: Subsystem, ends: list[State]) -> Iterator[Diagnostic]:
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
