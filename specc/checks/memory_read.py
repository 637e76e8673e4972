"""What is remembered is used for something."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.references import expressions
from specc.model.expr import MemoryRef, walk
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0615; memory that is not even written is `parts_used`'s matter."""
    task = system.task
    for subsystem in facts.subsystems:
        read = {
            node.name
            for expression in expressions(subsystem)
            for node in walk(expression)
            if isinstance(node, MemoryRef)
        }
        if task and task.subsystem == subsystem.qualified_name:
            read.update(task.watch)
        writers = {a.name: a for f in subsystem.functions for a in f.assignments if not a.peer}
        for element in subsystem.memory:
            if element.name in writers and element.name not in read:
                yield Diagnostic(
                    "W0615",
                    f"memory element `{element.name}` is written and never read",
                    element.place,
                    related=(Related(writers[element.name].place, "written here"),),
                    help="read or delete it, or have the task watch it",
                )
