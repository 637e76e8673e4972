"""Whenever a state ends by a cause, some row of that state and cause applies (2.4)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.words import ending, situation
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0601; a cause without any row is `causes_have_rows`'s matter."""
    for decided in facts.decided():
        gap = decided.verdict.decision.gap
        if gap and decided.verdict.rows:
            state = decided.state
            yield Diagnostic(
                "E0601",
                f"no row of state `{state.name}` applies {situation(gap)}",
                state.place,
                f"ended {ending(state.behaviour, decided.cause)}",
                tuple(
                    Related(row.place, f"asks `{row.condition.name}`")
                    for row in decided.verdict.rows
                ),
                "add a row for this, or say under `assume:` why it cannot be",
            )
