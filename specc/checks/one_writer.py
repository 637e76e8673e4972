"""A target has one writer per behaviour: all functions of a behaviour take effect at once."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
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
    writers = [Related(earlier.place, "here"), Related(assignment.place, "and here")]
    if earlier is assignment:
        writers = [Related(assignment.place, f"`{behaviour.name}` names the function twice")]
    return Diagnostic(
        "E0608",
        f"behaviour `{behaviour.name}` writes `{assignment.target}` twice",
        below(behaviour.place, "functions"),
        related=tuple(writers),
        help="keep one of the two, or give the functions to different behaviours",
    )
