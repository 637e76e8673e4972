"""Every row can be taken in some situation."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.words import ending
from specc.model.fsm import Transition
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0604 where the cause never occurs, W0605 where the condition never holds then.

    A condition that never holds at all, and an error that always does, are `conditions_vary`'s
    matter.
    """
    for decided in facts.decided():
        decision, state = decided.verdict.decision, decided.state
        behaviour = state.behaviour
        ended = behaviour.terminal if decided.cause == "terminal" else behaviour.error
        if facts.settled(decided.subsystem, ended) is False:
            continue
        if not decision.possible and facts.settled(decided.subsystem, behaviour.error):
            continue
        words = ending(behaviour, decided.cause)
        applying = zip(decided.verdict.rows, decision.satisfiable, strict=True)
        for row, possible in applying:
            if possible:
                continue
            if not decision.possible:
                yield Diagnostic(
                    "W0604",
                    f"state `{state.name}` never ends {words}",
                    row.place,
                    _never_taken(decided.subsystem, row, facts),
                    (Related(behaviour.place, f"behaviour `{behaviour.name}`"),),
                    "delete the row, or change the condition",
                )
            elif facts.settled(decided.subsystem, row.condition) is None:
                yield Diagnostic(
                    "W0605",
                    f"`{row.condition.name}` never holds when state `{state.name}` ends {words}",
                    row.place,
                    _never_taken(decided.subsystem, row, facts),
                    (Related(row.condition.place, f"`{row.condition.name}`"),),
                    "delete the row, or change the condition",
                )


def _never_taken(subsystem: Subsystem, row: Transition, facts: Facts) -> str:
    excluded = facts.lasting(subsystem).excludes(row)
    return "never taken: the times exclude it" if excluded else "never taken"
