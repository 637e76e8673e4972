"""What must hold so that a situation shows a refutation of rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from specc.example.exact import runnable
from specc.example.search import Goal
from specc.facts.partial import is_vague, sure, unmet
from specc.model.fsm import Cause, State
from specc.model.system import Subsystem
from specc.proof import Witness


def goals_of(
    subsystem: Subsystem, state: State, cause: Cause, witness: Witness
) -> Iterator[tuple[Goal, ...]]:
    """The state ends by the cause, the assumptions hold, and of its rows those of the witness.

    What is unknown is taken as the witness takes it.
    """
    if is_vague(subsystem, state, cause):
        subsystem = (sure if witness.holding else unmet)(cause).of(subsystem)
    behaviour = subsystem.state(state.name).behaviour
    given = [(behaviour.error.when, cause == "error")]
    if cause == "terminal":
        given.append((behaviour.terminal.when, True))
    given += [(axiom.that, True) for axiom in subsystem.axioms]
    given += witness.answers
    rows = [row.condition.when for _, row in subsystem.rows(state.name, cause)]
    held = [(when, index in witness.holding) for index, when in enumerate(rows)]
    yield _runnable([*given, *held])
    if len(rows) > len(witness.holding) > 0:
        yield _runnable([*given, *(goal for goal in held if goal[1])])


def _runnable(goals: Sequence[Goal]) -> tuple[Goal, ...]:
    return tuple((runnable(condition), yes) for condition, yes in goals)
