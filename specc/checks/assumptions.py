"""What is said under `assume:` can be true, and some proof needs it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from specc.analysis import Facts, Machine
from specc.analysis.graph import CAUSES
from specc.diagnostics import Diagnostic, Related
from specc.limits import spend
from specc.model.fsm import Cause
from specc.source import Place

# The assumptions of a subsystem can all be true; contradictions would prove anything.


def axioms_consistent(facts: Facts) -> Iterator[Diagnostic]:
    """E0609."""
    for machine in facts.machines:
        core = [machine.subsystem.axioms[i] for i in machine.prover.contradiction()]
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


def axioms_needed(facts: Facts) -> Iterator[Diagnostic]:
    """W0610; assumptions that concern wrong rows are not judged before these are correct."""
    for machine in facts.machines:
        proved = _proved(facts, machine) if machine.subsystem.axioms else ()
        yield from (d for d in machine.results_of(_useless) if d.primary not in proved)


def _proved(facts: Facts, machine: Machine) -> frozenset[Place]:
    """Where assumptions stand that follow from what is sent."""
    axioms = machine.subsystem.axioms
    return frozenset(
        a.place
        for a in axioms
        if facts.assumption_checker.check_assumption(machine, a).grounds == "proved"
    )


# No sender sends what an assumption excludes.


def axioms_kept(facts: Facts) -> Iterator[Diagnostic]:
    """W0619; only what is sent in one period of a sender is looked at."""
    for machine in facts.complete_machines:
        for axiom in machine.subsystem.axioms:
            judged = facts.assumption_checker.check_assumption(machine, axiom)
            if judged.grounds == "broken" and judged.state:
                yield Diagnostic(
                    "W0619",
                    f"state `{judged.state.name}` of the sender breaks this assumption",
                    axiom.place,
                    related=(Related(judged.state.place, "what it sends arrives together"),),
                    help="send it in different behaviours, or weaken the assumption",
                )
            elif judged.slower:
                name = judged.slower.qualified_name
                rates = [float(s.rate_hz) for s in (judged.slower, machine.subsystem)]
                yield Diagnostic(
                    "W0619",
                    f"nothing arrives from `{name}` in some periods, which breaks this assumption",
                    axiom.place,
                    related=(
                        Related(judged.slower.place, "{:g} Hz, its reader {:g} Hz".format(*rates)),
                    ),
                    help="weaken the assumption, or let the sender be as fast as its reader",
                )


def _useless(machine: Machine) -> Iterator[Diagnostic]:
    judged = machine.is_legible and not machine.dead_ends and machine.conditions_vary
    axioms, states = machine.subsystem.axioms, machine.subsystem.states
    wrong = list(_wrong(machine)) if judged and axioms else []
    for index, axiom in enumerate(axioms if judged else ()):
        # Each question looks at all assumptions, for each state and cause.
        if not spend("proof", 10 * len(axioms) * len(states)):
            return
        if not _is_needed(machine, index) and not any(
            _is_about(machine, state, cause, index) for state, cause in wrong
        ):
            yield Diagnostic(
                "W0610",
                "nothing is proved with the help of this assumption",
                axiom.place,
                help="delete it",
            )


def _wrong(machine: Machine) -> Iterator[tuple[str, Cause]]:
    """The states and causes whose rows have to be mended."""
    for state in machine.subsystem.states:
        for cause in CAUSES:
            verdict = machine.verdict(state.name, cause)
            decision = verdict.decision
            if decision.gap or decision.overlap or (decision.possible and not verdict.rows):
                yield state.name, cause


def _is_about(machine: Machine, state: str, cause: Cause, index: int) -> bool:
    """Whether the axiom has to do with the rows of a state and cause, which may be too few."""
    rows = machine.subsystem.rows(state, cause)
    return not rows or machine.prover.is_related(state, cause, index)


def _is_needed(machine: Machine, index: int) -> bool:
    """Whether something about a state and cause would be decided otherwise without the axiom."""
    return any(
        _decided(machine, state.name, cause, None) != _decided(machine, state.name, cause, index)
        for state in machine.subsystem.states
        for cause in CAUSES
    )


def _decided(machine: Machine, state: str, cause: Cause, without: int | None) -> tuple[object, ...]:
    """What the rows say about presence, and then what is known about the rows."""
    prove = partial(machine.prover.prove_rows, state, cause, without=without)
    before = prove().decision
    # What peers always send, at present, is left aside: it may well be said as an assumption.
    invariants = machine.prover.related_facts(state, cause, machine.invariants)
    present = machine.presence.in_conditions(state)
    after = prove(present=present, invariants=invariants).decision
    several = after.overlap.holding if after.overlap else ()
    found = after.proved, after.gap is None, several, after.possible, after.satisfiable
    return before.ensures, found


CHECKS = (axioms_consistent, axioms_needed, axioms_kept)
