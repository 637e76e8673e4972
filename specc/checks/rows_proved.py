"""What cannot be proved of rows is said, because it is then checked in every run."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.words import ending
from specc.model.system import System

_WAY_OUT = "the generated code checks it in every run; to have it proved, ask less in one table"


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0606."""
    for decided in facts.decided():
        reason = decided.verdict.decision.unknown
        if reason and decided.verdict.rows:
            state = decided.state
            yield Diagnostic(
                "W0606",
                f"it is not proved that exactly one row of state `{state.name}` applies: {reason}",
                state.place,
                f"ended {ending(state.behaviour, decided.cause)}",
                help=decided.verdict.decision.way_out or _WAY_OUT,
            )
