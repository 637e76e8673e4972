"""What is proved of rows holds for NaN as well: components that are not used, and results."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.examples import Examples
from specc.facts.steps import CAUSES
from specc.facts.words import ending, situation
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0616."""
    examples = Examples(facts)
    for subsystem in facts.whole_subsystems:
        for state in subsystem.states:
            for cause in CAUSES:
                witness = facts.unused_component(subsystem, state.name, cause)
                if witness is None:
                    continue
                count = "two rows apply" if witness.holding else "no row applies"
                yield Diagnostic(
                    "W0616",
                    f"in state `{state.name}` {count} {situation(witness)}",
                    state.place,
                    f"ended {ending(state.behaviour, cause)}",
                    tuple(Related(row.place, "a row") for row in facts.rows(subsystem, state.name)),
                    "every comparison with NaN is false: write `not a < b` for `a >= b`, ask first "
                    "for what tells that it is a number, or assume it, as in `a <= a`",
                    example=examples.text(subsystem, state, cause, witness),
                )
