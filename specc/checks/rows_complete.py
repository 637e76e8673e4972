"""Whenever a state ends by a cause, some row of that state and cause applies (2.4)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, count

from specc.diagnostics import Diagnostic, Related
from specc.expr import show
from specc.facts import Decided, Facts
from specc.facts.examples import Examples
from specc.facts.shared import Shared, shared
from specc.facts.words import ending, operators_in, situation
from specc.model.system import System
from specc.proof import Witness


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0601, once for all states that fail alike; a cause without any row is another matter."""
    examples = Examples(facts)
    for told in shared(facts, _gap):
        decided, widest, gap = told.first, told.widest, told.witness
        state = decided.state
        yield Diagnostic(
            "E0601",
            f"no row of {told.states} applies {situation(gap)}",
            state.place,
            f"ended {ending(state.behaviour, decided.cause)}",
            (
                *told.places,
                *(
                    Related(row.place, f"asks `{row.condition.name}`")
                    for row in decided.verdict.rows
                ),
            ),
            _way_out(told),
            example=examples.text(widest.subsystem, widest.state, widest.cause, gap),
        )


def _gap(decided: Decided) -> Witness | None:
    return decided.verdict.decision.gap if decided.verdict.rows else None


def _way_out(told: Shared) -> str:
    decided, gap = told.first, told.witness
    taken = {condition.name for condition in decided.subsystem.conditions}
    name = next(n for n in chain(("otherwise",), _numbered()) if n not in taken)
    assert gap.repair is not None  # there are rows
    also = " to each of these states" if told.others else ""
    return (
        f"add the row `[{decided.state.name}, {decided.cause}, {name}, ...]` with the initial "
        f'condition `{name}: "{show(gap.repair)}"`{also}, or say under `assume:` why it cannot be'
        f"{operators_in(gap)}"
    )


def _numbered() -> Iterator[str]:
    return (f"otherwise_{number}" for number in count(2))
