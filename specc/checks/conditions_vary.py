"""A declared condition, and every part of it, holds in some situation and fails in another."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.expr import show
from specc.facts import Facts
from specc.facts.constancy import Constancy, ConstantPart
from specc.facts.words import ms
from specc.model.expr import Unary
from specc.model.fsm import Condition
from specc.model.system import Subsystem, System
from specc.model.types import Bool
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0613 and W0617; what cannot be meant in a condition is `expressions_meant`'s matter."""
    told: set[Place] = set()
    for subsystem in facts.whole_subsystems:
        for finding in _findings(subsystem, facts):
            if finding.primary not in told:
                told.add(finding.primary)
                yield finding


def _findings(subsystem: Subsystem, facts: Facts) -> Iterator[Diagnostic]:
    misfits, constancy = facts.misfits(subsystem), Constancy(subsystem, facts)
    for condition in subsystem.conditions:
        settled = facts.settled(subsystem, condition)
        if settled is None:
            yield from map(_part, constancy.parts(condition))
        elif not misfits.within(condition.when):
            word = "always" if settled else "never"
            yield Diagnostic(
                "W0613",
                f"{condition.kind} condition `{condition.name}` {word} holds",
                condition.place,
                _time(subsystem, condition, settled, facts),
                help=f"say `{word}` where it is used, or mend the condition",
            )


def _time(subsystem: Subsystem, condition: Condition, settled: bool, facts: Facts) -> str:
    """That time settles a condition, if it does."""
    when = condition.when
    never = Unary("not", when, type=Bool()) if settled else when
    if not facts.lasting(subsystem).is_why(never):
        return ""
    return f"its times settle it; conditions are first asked after {ms(1 / subsystem.rate_hz)}"


def _part(part: ConstantPart) -> Diagnostic:
    word = "always" if part.holds else "never"
    condition = part.condition
    place = part.text.place(part.expr)
    elsewhere = place.route[: len(condition.place.route)] != condition.place.route
    named = f"{condition.kind} condition `{condition.name}`"
    return Diagnostic(
        "W0617",
        f"`{show(part.expr)}` {word} holds",
        place,
        "" if elsewhere else f"a part of {named}",
        (Related(condition.place, f"{named} asks it"),) if elsewhere else (),
        "mend it, or leave it out" if part.holds else "mend it, or leave out what it decides",
    )
