"""No condition waits for a time at which its state is over."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.lasting import Late
from specc.facts.words import listed, ms
from specc.model.fsm import Condition
from specc.model.system import Subsystem, System
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0618, once for each condition or row.

    What ends a state by mistake is the matter of `conditions_vary` and `expressions_meant`.
    """
    for subsystem in facts.whole_subsystems:
        yield from _findings(subsystem, facts)


def _findings(subsystem: Subsystem, facts: Facts) -> Iterator[Diagnostic]:
    told = set[Place]()
    for state in subsystem.states:
        for late in facts.lasting(subsystem).late(state):
            if any(_is_mistaken(subsystem, condition, facts) for condition in late.ended_by):
                continue
            finding = _finding(late, subsystem)
            if finding.primary not in told:
                told.add(finding.primary)
                yield finding


def _is_mistaken(subsystem: Subsystem, condition: Condition, facts: Facts) -> bool:
    settled = facts.settled(subsystem, condition) is not None
    return settled or facts.misfits(subsystem).within(condition.when)


def _finding(late: Late, subsystem: Subsystem) -> Diagnostic:
    """About the condition that ends a state at once, or else about the one that comes too late."""
    state, ends = late.state, late.ended_by
    asked = Related(late.condition.place, f"`{late.condition.name}`")
    behaviour = Related(state.behaviour.place, f"behaviour `{state.behaviour.name}`")
    if late.over_s == 1 / subsystem.rate_hz and ends == (state.behaviour.error,) and not late.row:
        return Diagnostic(
            "W0618",
            f"error condition `{ends[0].name}` always holds when it is first asked",
            ends[0].place,
            f"so `{late.condition.name}` never ends state `{state.name}`",
            (asked, behaviour),
            "an error is asked first: turn the comparison round, or give it a later time",
        )
    return Diagnostic(
        "W0618",
        _too_late(late),
        late.row.place if late.row else late.condition.place,
        "never taken" if late.row else "never ends it",
        (
            *(Related(condition.place, _part(condition, late)) for condition in ends),
            asked if late.row else behaviour,
        ),
        "change one of the two times"
        if late.timed
        else f"let the state last longer, or change `{late.condition.name}`",
    )


def _too_late(late: Late) -> str:
    """What is said of a condition; what ends a state and names no time does so at once."""
    state, name, over = late.state.name, late.condition.name, ms(late.over_s)
    if late.timed:
        return f"state `{state}` is over, after {over}, before `{name}` can hold"
    ends = listed([f"`{condition.name}`" for condition in late.ended_by], "or")
    return f"{ends} ends state `{state}` in its first period, {over}, before `{name}` can hold"


def _part(condition: Condition, late: Late) -> str:
    if len(late.ended_by) > 1:
        return f"`{condition.name}`, if not the other, ends it by then"
    return f"`{condition.name}` ends it by then"
