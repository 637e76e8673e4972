"""No condition waits for a time at which its state is over."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.lasting import Lasting, Late
from specc.facts.words import ms
from specc.model.system import Subsystem, System
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0618, once for each behaviour or row."""
    for subsystem in facts.whole_subsystems:
        yield from _findings(subsystem, facts)


def _findings(subsystem: Subsystem, facts: Facts) -> Iterator[Diagnostic]:
    lasting, told = Lasting(subsystem, facts), set[tuple[Place, ...]]()
    for state in subsystem.states:
        for late in lasting.late(state):
            finding = _finding(late, subsystem)
            key = (finding.primary, *(related.place for related in finding.related))
            if key not in told:
                told.add(key)
                yield finding


def _finding(late: Late, subsystem: Subsystem) -> Diagnostic:
    """About the condition that ends a state at once, or else about the one that comes too late."""
    state, ends = late.state, late.ended_by
    asked = Related(late.condition.place, f"`{late.condition.name}`")
    behaviour = Related(state.behaviour.place, f"behaviour `{state.behaviour.name}`")
    if late.over_s == 1 / subsystem.rate_hz and ends.kind == "error" and late.row is None:
        return Diagnostic(
            "W0618",
            f"error condition `{ends.name}` always holds when it is first asked",
            ends.place,
            f"so `{late.condition.name}` never ends state `{state.name}`",
            (asked, behaviour),
            "an error is asked first: turn the comparison round, or give it a later time",
        )
    return Diagnostic(
        "W0618",
        f"state `{state.name}` is over, after {ms(late.over_s)}, before `{late.condition.name}` "
        "can hold",
        late.row.place if late.row else late.condition.place,
        "never taken" if late.row else "never ends it",
        (Related(ends.place, f"`{ends.name}` ends it by then"), asked if late.row else behaviour),
        "change one of the two times",
    )
