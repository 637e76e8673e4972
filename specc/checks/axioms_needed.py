"""Every assumption is needed for a proof; one that is not only looks like an argument."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.steps import CAUSES
from specc.model.fsm import Cause
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0610."""
    for subsystem in facts.proved_subsystems:
        for index, axiom in enumerate(subsystem.axioms):
            if not _is_needed(subsystem, index, facts):
                yield Diagnostic(
                    "W0610",
                    "nothing is proved with the help of this assumption",
                    axiom.place,
                    help="delete it",
                )


def _is_needed(subsystem: Subsystem, index: int, facts: Facts) -> bool:
    """Whether something about a state and cause would be decided otherwise without the axiom."""
    return any(
        _decided(subsystem, state.name, cause, None, facts)
        != _decided(subsystem, state.name, cause, index, facts)
        for state in subsystem.states
        for cause in CAUSES
    )


def _decided(
    subsystem: Subsystem, state: str, cause: Cause, without: int | None, facts: Facts
) -> tuple[object, ...]:
    """What the rows tell about presence, and then what is known of the rows."""
    before = facts.prover(subsystem).prove_rows(state, cause, without=without).decision
    after = facts.verdict(subsystem, state, cause, without=without).decision
    several = after.overlap.holding if after.overlap else ()
    found = after.proved, after.gap is None, several, after.possible, after.satisfiable
    for_nan = facts.unused_component(subsystem, state, cause, without=without)
    return before.ensures, found, for_nan is None
