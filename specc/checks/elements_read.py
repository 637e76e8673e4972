"""What is sent to a subsystem is read there."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.references import inputs_read
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0412, at the end that receives the element.

    What devices and reused descriptions send is not for the reader to choose.
    """
    for subsystem in facts.subsystems:
        read = inputs_read(subsystem)
        for port in subsystem.ports:
            sender = facts.connections.subsystems.get(port.other_end)
            if port.direction == "y" or sender is None or _is_given(sender, subsystem):
                continue
            for element in port.elements:
                if (port.peer, element.name) not in read:
                    yield Diagnostic(
                        "W0412",
                        f"`{subsystem.qualified_name}` never reads `x.{port.peer}.{element.name}`",
                        element.place,
                        related=(Related(sender.place, f"`{port.other_end}` has it in its `y`"),),
                        help="use it, or delete it at both ends",
                    )


def _is_given(sender: Subsystem, reader: Subsystem) -> bool:
    return sender.place.file != reader.place.file
