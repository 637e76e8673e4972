"""A target has one writer per behaviour: all functions of a behaviour take effect at once."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.model.fsm import Assignment, Behaviour
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0608."""
    for subsystem in facts.subsystems:
        for behaviour in subsystem.behaviours:
            first: dict[str, Assignment] = {}
            for assignment in behaviour.assignments:
                if assignment.target in first:
                    yield _twice(behaviour, assignment, first[assignment.target])
                first.setdefault(assignment.target, assignment)


def _twice(behaviour: Behaviour, assignment: Assignment, earlier: Assignment) -> Diagnostic:
    if earlier is assignment:
        where = Related(behaviour.place, f"`{behaviour.name}` names the function twice")
    else:
        where = Related(earlier.place, f"`{behaviour.name}` writes it here as well")
    return Diagnostic(
        "E0608",
        f"behaviour `{behaviour.name}` writes `{assignment.target}` twice",
        assignment.place,
        related=(where,),
        help="keep one of the two, or give the functions to different behaviours",
    )
