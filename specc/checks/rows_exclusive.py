"""Whenever a state ends by a cause, at most one row of that state and cause applies (2.4)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.expr import show
from specc.facts import Decided, Facts
from specc.facts.examples import Examples
from specc.facts.words import ending, operators_in, situation
from specc.model.fsm import Transition
from specc.model.system import System
from specc.proof import Witness

_MOST = 6
"""Rows of which every two are compared, and other pairs that are told."""


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0602, for the first two rows that can apply together; the others are related."""
    examples = Examples(facts)
    for decided in facts.decided():
        overlap = decided.verdict.decision.overlap
        if overlap:
            state = decided.state
            first, second = (decided.verdict.rows[i] for i in overlap.holding)
            yield Diagnostic(
                "E0602",
                f"two rows of state `{state.name}` apply {situation(overlap)}",
                second.place,
                f"applies when it ended {ending(state.behaviour, decided.cause)}",
                (Related(first.place, "and so does this row"), *_others(decided, overlap, facts)),
                _way_out(overlap, decided.verdict.rows),
                example=examples.text(decided.subsystem, state, decided.cause, overlap),
            )


def _others(decided: Decided, told: Witness, facts: Facts) -> Iterator[Related]:
    """The other pairs of rows that can apply together, at the second of them."""
    rows = decided.verdict.rows
    pairs = ((i, j) for j in range(len(rows)) for i in range(j) if (i, j) != told.holding)
    left = _MOST
    for pair in pairs if len(rows) <= _MOST else ():
        overlap = facts.overlap(decided, pair)
        if overlap and left:
            left -= 1
            name = rows[pair[0]].condition.name
            words = f"applies {situation(overlap)}, and so does the row that asks `{name}`"
            yield Related(rows[pair[1]].place, words)


def _way_out(overlap: Witness, rows: tuple[Transition, ...]) -> str:
    other = f"or say under `assume:` why it cannot be{operators_in(overlap)}"
    if overlap.repair is None or overlap.repaired is None:
        return f"delete one of the two rows, {other}"
    which = "this row" if overlap.repaired == overlap.holding[-1] else "the other row"
    asked = rows[overlap.repaired].condition.name
    return f'let {which} ask for "{show(overlap.repair)}" instead of `{asked}`, {other}'
