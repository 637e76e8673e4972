"""A bare name in the expressions of a subsystem means one thing."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.expr import RESERVED
from specc.facts import Facts
from specc.model.system import Constant, Let, Memory, Outside, Subsystem, System

Named = Memory | Let | Constant | Outside


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0221; constants and files hold in the subsystems that their own file describes."""
    for subsystem in facts.subsystems:
        first: dict[str, tuple[str, Named]] = {}
        for kind, part in _named(subsystem):
            earlier = first.setdefault(part.name, (kind, part))
            if part.name in RESERVED:
                yield Diagnostic(
                    "E0221",
                    f"`{part.name}` is a word of the language and cannot name a {kind}",
                    part.place,
                    help="choose another name",
                )
            elif earlier[1] is not part:
                yield Diagnostic(
                    "E0221",
                    f"`{part.name}` names a {kind} and a {earlier[0]}",
                    part.place,
                    related=(Related(earlier[1].place, f"the {earlier[0]}"),),
                    help="choose another name for one of the two",
                )


def _named(subsystem: Subsystem) -> Iterator[tuple[str, Named]]:
    yield from ((item.kind, item) for item in subsystem.outside)
    yield from (("parameter", c) for c in subsystem.constants)
    yield from (("memory element", m) for m in subsystem.memory)
    yield from (("let", item) for item in subsystem.lets)
