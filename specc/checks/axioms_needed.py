"""Every assumption is needed for a proof; one that is not only looks like an argument."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.steps import CAUSES
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0610."""
    for subsystem in facts.consistent_subsystems:
        for index, axiom in enumerate(subsystem.axioms):
            if not _is_needed(subsystem, index, facts):
                yield Diagnostic(
                    "W0610",
                    "nothing is proved with the help of this assumption",
                    axiom.place,
                    help="delete it",
                )


def _is_needed(subsystem: Subsystem, index: int, facts: Facts) -> bool:
    """Whether a decision about some state and cause would be another without the axiom."""
    prover = facts.prover(subsystem)
    return any(
        prover.prove_rows(state.name, cause) != prover.prove_rows(state.name, cause, without=index)
        for state in subsystem.states
        for cause in CAUSES
    )
