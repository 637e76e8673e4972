"""What is said under `assume:` can be true, and some proof needs it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from specc.analysis import Facts
from specc.analysis.graph import CAUSES
from specc.diagnostics import Diagnostic, Related
from specc.limits import spend
from specc.model.fsm import Cause
from specc.model.system import Subsystem, System

# The assumptions of a subsystem can all be true; contradictions would prove anything.


def axioms_consistent(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0609."""
    for subsystem in facts.subsystems:
        core = [subsystem.axioms[i] for i in facts.prover(subsystem).contradiction()]
        if core:
            several = len(core) > 1
            yield Diagnostic(
                "E0609",
                "these assumptions contradict each other"
                if several
                else "this assumption is never true",
                core[-1].place,
                related=tuple(Related(axiom.place, "assumed as well") for axiom in core[:-1]),
                help="delete or weaken one" if several else "delete or weaken it",
            )


# Every assumption is needed for a proof; one that is not only looks like an argument.


def axioms_needed(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0610; assumptions that concern wrong rows are not judged before these are correct."""
    for subsystem in facts.known_machines:
        if facts.dead_ends(subsystem) or not facts.conditions_vary(subsystem):
            continue
        wrong = list(_wrong(subsystem, facts))
        for index, axiom in enumerate(subsystem.axioms):
            # Each question looks at all assumptions, for each state and cause.
            if not spend("proof", 10 * len(subsystem.axioms) * len(subsystem.states)):
                return
            if not _is_needed(subsystem, index, facts) and not any(
                _is_about(subsystem, state, cause, index, facts) for state, cause in wrong
            ):
                yield Diagnostic(
                    "W0610",
                    "nothing is proved with the help of this assumption",
                    axiom.place,
                    help="delete it",
                )


def _wrong(subsystem: Subsystem, facts: Facts) -> Iterator[tuple[str, Cause]]:
    """The states and causes whose rows have to be mended."""
    for state in subsystem.states:
        for cause in CAUSES:
            verdict = facts.verdict(subsystem, state.name, cause)
            decision = verdict.decision
            if decision.gap or decision.overlap or (decision.possible and not verdict.rows):
                yield state.name, cause


def _is_about(subsystem: Subsystem, state: str, cause: Cause, index: int, facts: Facts) -> bool:
    """Whether the axiom has to do with the rows of a state and cause, which may be too few."""
    prover = facts.prover(subsystem)
    return not prover.prove_rows(state, cause).rows or prover.is_related(state, cause, index)


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
    """What the rows say about presence, and then what is known about the rows."""
    prove = partial(facts.prover(subsystem).prove_rows, state, cause, without=without)
    before = prove().decision
    # What peers always send, at present, is left aside: it may well be said as an assumption.
    after = prove(present=facts.presence(subsystem).in_conditions(state)).decision
    several = after.overlap.holding if after.overlap else ()
    found = after.proved, after.gap is None, several, after.possible, after.satisfiable
    return before.ensures, found


CHECKS = (axioms_consistent, axioms_needed)
