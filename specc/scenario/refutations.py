"""What the checks have refuted of the machines of a system, as goals that a run can meet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from specc.checks import (
    presence_in_axioms,
    presence_in_conditions,
    presence_in_functions,
    presence_in_memory,
)
from specc.example.search import Goal
from specc.facts import Decided, Facts
from specc.facts.words import ending, situation
from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.proof import InputName

CODES = ("E0601", "E0602", "E0603", "E0701", "E0702", "E0703", "E0704")
"""Codes of findings that a run can show."""


@dataclass(frozen=True, slots=True)
class Refutation:
    """A finding that a run can show.

    Either none or several rows apply when a state ends by a cause, or an input is read that may
    have no value.

    Attributes:
        words: what is wrong, in words.
        goals: the witness about rows.
        rows: rows that apply; with none of them, no row does.
        absent: the input that is read; empty if it is about rows.
    """

    code: str
    subsystem: str
    state: str
    cause: Cause | None
    words: str
    goals: tuple[Goal, ...] = ()
    rows: tuple[Transition, ...] = ()
    absent: InputName | None = None


def refutations(facts: Facts) -> Iterator[Refutation]:
    """The refutations of a system, in the order of its states."""
    for decided in facts.decided():
        yield from _of_rows(decided, facts)
    for subsystem in facts.consistent_subsystems:
        yield from _of_absence(subsystem, facts)


def _of_rows(decided: Decided, facts: Facts) -> Iterator[Refutation]:
    """E0601, E0602, E0603."""
    verdict, state, cause = decided.verdict, decided.state, decided.cause
    gap, overlap = verdict.decision.gap, verdict.decision.overlap
    name, ended = decided.subsystem.qualified_name, ending(state.behaviour, cause)
    if gap and verdict.rows:
        words = f"no row of state `{state.name}` applies {situation(gap)}"
        yield Refutation("E0601", name, state.name, cause, words, gap.answers)
    elif facts.lacks_rows(decided) and not _is_unfinished(decided, facts):
        words = f"state `{state.name}` can end {ended} and has no row for that"
        yield Refutation("E0603", name, state.name, cause, words)
    if overlap:
        rows = tuple(verdict.rows[index] for index in overlap.holding)
        words = f"two rows of state `{state.name}` apply {situation(overlap)}"
        yield Refutation("E0602", name, state.name, cause, words, overlap.answers, rows)


def _is_unfinished(decided: Decided, facts: Facts) -> bool:
    """Whether the table has no rows for the state yet."""
    return any(decided.state is state for state in facts.dead_ends(decided.subsystem))


def _of_absence(subsystem: Subsystem, facts: Facts) -> Iterator[Refutation]:
    """E0701 to E0704, once for each input and state."""
    told = set()
    for code, absences in _ABSENCES.items():
        for absence in absences(subsystem, facts):
            state = absence.state or subsystem.initial_state
            name = absence.reading.name
            if (code, state, name) not in told:
                told.add((code, state, name))
                input_ = f"`x.{name[0]}.{name[1]}`"
                words = f"{input_} may have no value {absence.where}, where {absence.what} reads it"
                yield Refutation(code, subsystem.qualified_name, state, None, words, absent=name)


_ABSENCES = {
    "E0701": presence_in_functions.absences,
    "E0702": presence_in_conditions.absences,
    "E0703": presence_in_memory.absences,
    "E0704": presence_in_axioms.absences,
}
