"""What the checks have refuted of the machines of a system, as goals that a run can meet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from specc.facts import Decided, Facts
from specc.facts.steps import CAUSES
from specc.facts.words import ending, situation
from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.proof import Witness
from specc.scenario.search import Goal
from specc.source import Place

CODES = ("E0601", "E0602", "E0603", "W0616")
"""Codes of findings that a run can show."""


@dataclass(frozen=True, slots=True)
class Refutation:
    """A finding that a run can show: in a state that ends by a cause, none or several rows apply.

    Attributes:
        words: what is wrong, in words.
        place: where the finding points.
        goals: the witness.
        rows: rows that apply; with none of them, no row does.
    """

    code: str
    subsystem: str
    state: str
    cause: Cause
    words: str
    place: Place
    goals: tuple[Goal, ...]
    rows: tuple[Transition, ...]


def refutations(facts: Facts) -> Iterator[Refutation]:
    """The refutations of a system, in the order of its states."""
    for decided in facts.decided():
        yield from _of_rows(decided, facts)
    for subsystem in facts.whole_subsystems:
        yield from _of_unused_components(subsystem, facts)


def _of_rows(decided: Decided, facts: Facts) -> Iterator[Refutation]:
    """E0601, E0602, E0603."""
    verdict, state, cause = decided.verdict, decided.state, decided.cause
    gap, overlap = verdict.decision.gap, verdict.decision.overlap
    name, ended = decided.subsystem.qualified_name, ending(state.behaviour, cause)
    if gap and verdict.rows:
        words = f"no row of state `{state.name}` applies {situation(gap)}"
        yield Refutation("E0601", name, state.name, cause, words, state.place, gap.answers, ())
    elif not verdict.rows and verdict.decision.possible and not _is_unfinished(decided, facts):
        words = f"state `{state.name}` can end {ended} and has no row for that"
        yield Refutation("E0603", name, state.name, cause, words, state.place, (), ())
    if overlap:
        rows = tuple(verdict.rows[index] for index in overlap.holding)
        words = f"two rows of state `{state.name}` apply {situation(overlap)}"
        yield Refutation(
            "E0602", name, state.name, cause, words, rows[-1].place, overlap.answers, rows
        )


def _is_unfinished(decided: Decided, facts: Facts) -> bool:
    """Whether the table has no rows for the state yet."""
    return any(decided.state is state for state in facts.dead_ends(decided.subsystem))


def _of_unused_components(subsystem: Subsystem, facts: Facts) -> Iterator[Refutation]:
    """W0616."""
    for state in subsystem.states:
        for cause in CAUSES:
            witness = facts.unused_component(subsystem, state.name, cause)
            if witness is not None:
                rows = _held(witness, subsystem, state.name, cause)
                count = "two rows apply" if rows else "no row applies"
                words = f"in state `{state.name}` {count} {situation(witness)}"
                name = subsystem.qualified_name
                yield Refutation(
                    "W0616", name, state.name, cause, words, state.place, witness.answers, rows
                )


def _held(
    witness: Witness, subsystem: Subsystem, state: str, cause: Cause
) -> tuple[Transition, ...]:
    rows = [row for _, row in subsystem.rows(state, cause)]
    return tuple(rows[index] for index in witness.holding)
