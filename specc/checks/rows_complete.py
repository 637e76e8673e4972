"""Whenever a state ends by a cause, some row of that state and cause applies (2.4)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, count

from specc.diagnostics import Diagnostic, Related
from specc.expr import show
from specc.facts import Decided, Facts
from specc.facts.examples import Examples
from specc.facts.words import ending, operators_in, situation
from specc.model.system import System
from specc.proof import Witness


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0601; a cause without any row is `causes_have_rows`'s matter."""
    examples = Examples(facts)
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
                _way_out(decided, gap),
                example=examples.text(decided.subsystem, state, decided.cause, gap),
            )


def _way_out(decided: Decided, gap: Witness) -> str:
    taken = {condition.name for condition in decided.subsystem.conditions}
    name = next(n for n in chain(("otherwise",), _numbered()) if n not in taken)
    assert gap.repair is not None  # there are rows
    return (
        f"add the row `[{decided.state.name}, {decided.cause}, {name}, ...]` with the initial "
        f'condition `{name}: "{show(gap.repair)}"`, or say under `assume:` why it cannot be'
        f"{operators_in(gap)}"
    )


def _numbered() -> Iterator[str]:
    return (f"otherwise_{number}" for number in count(2))
