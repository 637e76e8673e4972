"""Assumptions can be true, no sender breaks them, and some proof needs them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from specc.analysis import Facts, Machine
from specc.diagnostics import Diagnostic, Related
from specc.limits import spend
from specc.model.fsm import Cause

# The assumptions of a subsystem can all be true; contradictions would prove anything.


def axioms_consistent(facts: Facts) -> Iterator[Diagnostic]:
    """E0609, for assumptions that contradict each other."""
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
    """W0610; assumptions that concern wrong rows are not reported before these are correct."""
    check = facts.assumption_checker.check_assumption
    for machine in facts.machines:
        axioms = machine.subsystem.axioms
        proved = {a.place for a in axioms if check(machine, a).grounds == "proved"}
        yield from (d for d in _unneeded(machine) if d.primary not in proved)


# No sender sends what an assumption excludes.


def axioms_hold(facts: Facts) -> Iterator[Diagnostic]:
    """W0619; only what is sent in one period of a sender is looked at."""
    for machine in facts.complete_machines:
        for axiom in machine.subsystem.axioms:
            verdict = facts.assumption_checker.check_assumption(machine, axiom)
            if verdict.grounds == "broken" and verdict.state:
                yield Diagnostic(
                    "W0619",
                    f"state `{verdict.state.name}` of the sender breaks this assumption",
                    axiom.place,
                    related=(Related(verdict.state.place, "what it sends arrives together"),),
                    help="send it in different behaviours, or weaken the assumption",
                )
            elif verdict.slower:
                name = verdict.slower.qualified_name
                rates = [float(s.rate_hz) for s in (verdict.slower, machine.subsystem)]
                yield Diagnostic(
                    "W0619",
                    f"nothing arrives from `{name}` in some periods, which breaks this assumption",
                    axiom.place,
                    related=(
                        Related(verdict.slower.place, "{:g} Hz, its reader {:g} Hz".format(*rates)),
                    ),
                    help="weaken the assumption, or let the sender be as fast as its reader",
                )


def _unneeded(machine: Machine) -> Iterator[Diagnostic]:
    axioms, states = machine.subsystem.axioms, machine.subsystem.states
    if not machine.has_known_conditions or machine.dead_ends or not machine.conditions_vary:
        return
    if not axioms:
        return
    every = [(state.name, cause) for state in states for cause in state.behaviour.causes]
    wrong = []  # their rows have to be corrected, and may be too few
    for each in every:
        rows, decision = machine.verdict(*each).rows, machine.verdict(*each).decision
        if decision.gap or decision.overlap or (decision.possible and not rows):
            wrong.append(each)
    for index, axiom in enumerate(axioms):
        # Each question looks at all assumptions, for each state and cause.
        if not spend("proof", 10 * len(axioms) * len(states)):
            return
        is_needed = any(
            _decided(machine, *each, None) != _decided(machine, *each, index) for each in every
        ) or any(
            not machine.subsystem.rows(*each) or machine.prover.is_related(*each, index)
            for each in wrong
        )
        if not is_needed:
            yield Diagnostic(
                "W0610",
                "nothing is proved with the help of this assumption",
                axiom.place,
                help="delete it",
            )


def _decided(machine: Machine, state: str, cause: Cause, without: int | None) -> tuple[object, ...]:
    """What the rows ensure, and the verdict about them."""
    prove = partial(machine.prover.prove_rows, state, cause, without=without)
    before = prove().decision
    # What peers always send, at present, is left aside: it may well be said as an assumption.
    invariants = machine.prover.related_facts(state, cause, machine.invariants)
    present = machine.presence.in_conditions(state)
    after = prove(present=present, invariants=invariants).decision
    several = after.overlap.holding if after.overlap else ()
    found = after.proved, after.gap is None, several, after.possible, after.satisfiable
    return before.ensures, found
