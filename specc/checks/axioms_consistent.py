"""The assumptions of a subsystem can all be true; contradictions would prove anything."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0609."""
    for subsystem in facts.subsystems:
        core = [subsystem.axioms[i] for i in facts.prover(subsystem).contradiction()]
        if core:
            several = len(core) > 1
            yield Diagnostic(
                "E0609",
                "these assumptions contradict each other" if several else "this is never true",
                core[-1].place,
                related=tuple(Related(axiom.place, "assumed as well") for axiom in core[:-1]),
                help="delete or weaken one" if several else "delete or weaken it",
            )
