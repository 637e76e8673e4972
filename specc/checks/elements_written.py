"""Every element of an output buffer is written by some behaviour."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0413."""
    for subsystem in facts.subsystems:
        behaviours = {state.behaviour.name: state.behaviour for state in subsystem.states}
        written = {(a.peer, a.name) for b in behaviours.values() for a in b.assignments}
        for port in subsystem.ports:
            for element in port.elements if port.direction == "y" else ():
                if (port.peer, element.name) in written:
                    continue
                reader = facts.connections.subsystems.get(port.other_end)
                yield Diagnostic(
                    "W0413",
                    f"no behaviour of `{subsystem.qualified_name}` writes "
                    f"`y.{port.peer}.{element.name}`",
                    element.place,
                    "never sent",
                    (Related(reader.place, "waits for it in vain"),) if reader else (),
                    "write it in a function of a behaviour, or delete it at both ends",
                )
