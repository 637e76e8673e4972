"""A cause that can occur in a state has rows."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.words import ending
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0603."""
    for decided in facts.decided():
        if decided.verdict.rows or not decided.verdict.decision.possible:
            continue
        state, cause = decided.state, decided.cause
        condition = state.behaviour.terminal if cause == "terminal" else state.behaviour.error
        yield Diagnostic(
            "E0603",
            f"state `{state.name}` has no row for its {cause} condition",
            state.place,
            f"can end {ending(state.behaviour, cause)}",
            (Related(condition.place, f"the {cause} condition"),),
            f"add a row, e.g. `[{state.name}, {cause}, always, {state.name}]`",
        )
