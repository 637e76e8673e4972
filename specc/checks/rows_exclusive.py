"""Whenever a state ends by a cause, at most one row of that state and cause applies (2.4)."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.expr import show
from specc.facts import Facts
from specc.facts.examples import Examples
from specc.facts.shared import Shared, shared
from specc.facts.words import ending, operators_in, situation
from specc.model.system import System

_MOST = 6
"""Rows of which every two are compared, and other pairs that are told."""


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0602, for two rows that can apply together; others of the same states are related."""
    examples = Examples(facts)
    for told in shared(facts, lambda decided: decided.verdict.decision.overlap):
        decided, widest, overlap = told.first, told.widest, told.witness
        one, other = overlap.holding
        first, second = decided.verdict.rows[one], decided.verdict.rows[other]
        others = tuple(_others(told, facts))
        also = "and so does this row"
        if others and (own := facts.overlap(widest, (one, other))):
            also += f" {situation(own)}"
        yield Diagnostic(
            "E0602",
            f"two rows of {told.states} apply {situation(overlap)}",
            second.place,
            f"applies when it ended {ending(decided.state.behaviour, decided.cause)}",
            (Related(first.place, also), *others, *told.places),
            _way_out(told),
            example=examples.text(widest.subsystem, widest.state, widest.cause, overlap),
        )


def _others(told: Shared, facts: Facts) -> Iterator[Related]:
    """The other pairs of rows that can apply together, at the second of them."""
    rows, holding = told.first.verdict.rows, told.witness.holding
    pairs = ((i, j) for j in range(len(rows)) for i in range(j) if (i, j) != holding)
    left = _MOST
    for pair in pairs if len(rows) <= _MOST else ():
        overlap = facts.overlap(told.widest, pair)
        if overlap and left:
            left -= 1
            name = rows[pair[0]].condition.name
            words = f"applies {situation(overlap)}, and so does the row that asks `{name}`"
            yield Related(rows[pair[1]].place, words)


def _way_out(told: Shared) -> str:
    overlap, rows = told.witness, told.first.verdict.rows
    other = f"or say under `assume:` why it cannot be{operators_in(overlap)}"
    also = " in each of these states" if told.others else ""
    if overlap.repair is None or overlap.repaired is None:
        return f"delete one of the two rows{also}, {other}"
    which = "this row" if overlap.repaired == overlap.holding[-1] else "the other row"
    asked = rows[overlap.repaired].condition.name
    return f'let {which} ask for "{show(overlap.repair)}" instead of `{asked}`{also}, {other}'
