"""Every row can be taken in some situation."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.words import ending
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0604 where the cause never occurs, W0605 where the condition never holds then."""
    for decided in facts.decided():
        decision, state = decided.verdict.decision, decided.state
        words = ending(state.behaviour, decided.cause)
        for row, possible in zip(decided.verdict.rows, decision.satisfiable, strict=True):
            if not decision.possible:
                yield Diagnostic(
                    "W0604",
                    f"state `{state.name}` never ends {words}",
                    row.place,
                    "never taken",
                    (Related(state.behaviour.place, f"behaviour `{state.behaviour.name}`"),),
                    "delete the row, or change the condition",
                )
            elif not possible:
                yield Diagnostic(
                    "W0605",
                    f"`{row.condition.name}` never holds when state `{state.name}` ends {words}",
                    row.place,
                    "never taken",
                    (Related(row.condition.place, f"`{row.condition.name}`"),),
                    "delete the row, or change the condition",
                )
