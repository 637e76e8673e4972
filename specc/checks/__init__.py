"""What is checked of a resolved system, by subject: a module knows its own checks."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from types import ModuleType

from specc.analysis import Facts
from specc.answers import AnswerCache
from specc.checks import (
    assumptions,
    bindings,
    budgets,
    commands,
    constancy,
    counters,
    disturbances,
    duplicates,
    ends,
    expressions,
    formulas,
    holding,
    joint_order,
    plant,
    poses,
    presence,
    python,
    rows,
    scenes,
    states,
    structure,
    timing,
    topics,
    usage,
    waiting,
)
from specc.diagnostics import Diagnostic, stops
from specc.limits import is_used_up
from specc.model.system import System
from specc.source import Place

CheckFunction = Callable[[Facts], Iterator[Diagnostic]]

SUBJECTS: tuple[ModuleType, ...] = (
    structure,
    ends,
    timing,
    budgets,
    plant,
    bindings,
    joint_order,
    poses,
    commands,
    topics,
    scenes,
    disturbances,
    expressions,
    rows,
    constancy,
    counters,
    duplicates,
    formulas,
    holding,
    states,
    assumptions,
    presence,
    python,
    usage,
    waiting,
)
"""Modules of checks, each with a tuple `CHECKS` or `USES` at its end."""

CHECKS: tuple[CheckFunction, ...] = tuple(
    c for each in SUBJECTS for c in getattr(each, "CHECKS", ())
)

USES: tuple[CheckFunction, ...] = tuple(c for each in SUBJECTS for c in getattr(each, "USES", ()))
"""Unused parts are reported only when nothing is wrong: parts with errors use nothing."""


def run_checks(
    system: System,
    broken: frozenset[str] = frozenset(),
    faulty: frozenset[str] = frozenset(),
    *,
    sound: bool = True,
    kept: AnswerCache | None = None,
) -> tuple[list[Diagnostic], Facts]:
    """All findings about a system, and what was found out on the way.

    `broken` names the subsystems and devices with errors of their own; they are left out;
    `faulty` those with unknowns in them, about which less is said. The system is not `sound` if
    anything else was wrong before. `kept` is what an earlier analysis found out. Nothing is found
    of a system that is refused for its size, which the caller reports: the rest was not read.
    """
    facts = Facts(system, broken, faulty, kept)
    if is_used_up("parts"):
        return [], facts
    found = [finding for check in CHECKS for finding in check(facts)]
    sound = sound and not broken and not faulty
    if sound and not any(stops(finding.code, "build") for finding in found):
        found += [finding for check in USES for finding in check(facts)]
    found = _in_all_uses(found, facts)
    return found, facts


_OF_DEAD_PARTS = ("W0604", "W0605", "W0607", "W0614")


def _in_all_uses(found: list[Diagnostic], facts: Facts) -> list[Diagnostic]:
    """The findings, of dead parts only those that are dead in all uses of a description.

    A row that one value of a parameter excludes is there for the other values.
    """
    told = Counter(_said(finding) for finding in found if finding.code in _OF_DEAD_PARTS)
    uses: Counter[Place] = Counter()
    for machine in facts.machines if told else ():
        subsystem = machine.subsystem
        uses.update({state.place for state in subsystem.states})
        uses.update({row.place for row in subsystem.transitions})
    alive = {said for said, count in told.items() if count < uses[said[1]]}
    return [finding for finding in found if _said(finding) not in alive]


def _said(finding: Diagnostic) -> tuple[str, Place, str]:
    return finding.code, finding.primary, finding.message
