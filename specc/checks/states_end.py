"""A state whose behaviour has a terminal condition can be ended by it."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.words import ending
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0614.

    Where there are rows, they are `rows_can_apply`'s matter; a condition that never holds at all
    is `conditions_vary`'s.
    """
    for subsystem in facts.whole_subsystems:
        for state in subsystem.states:
            verdict = facts.verdict(subsystem, state.name, "terminal")
            if verdict.rows or verdict.decision.possible:
                continue
            condition, error = state.behaviour.terminal, state.behaviour.error
            if facts.prover(subsystem).constant(condition.when) is not False:
                yield Diagnostic(
                    "W0614",
                    f"state `{state.name}` never ends {ending(state.behaviour, 'terminal')}",
                    state.place,
                    f"the error condition `{error.name}` holds whenever that does",
                    (Related(condition.place, "the terminal condition"),),
                    "say `terminal: never` if that is meant, or change a condition",
                )
