"""Every named part of a subsystem is used somewhere in it."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.model.expr import LetRef, MemoryRef, walk
from specc.model.fsm import Behaviour, Condition, Function
from specc.model.system import Let, Memory, Subsystem, System

Part = Behaviour | Condition | Function | Let | Memory


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0611."""
    task = system.task
    for subsystem in facts.whole_subsystems:
        watched = task.watch if task and task.subsystem == subsystem.qualified_name else ()
        for kind, part in _unused(subsystem, watched):
            yield Diagnostic(
                "W0611", f"{kind} `{part.name}` is not used", part.place, help="use or delete it"
            )


def _unused(subsystem: Subsystem, watched: tuple[str, ...]) -> Iterator[tuple[str, Part]]:
    behaviours = {state.behaviour.name for state in subsystem.states}
    functions = {f.name for b in subsystem.behaviours for f in b.functions}
    conditions = {("initial", row.condition.name) for row in subsystem.transitions}
    for behaviour in subsystem.behaviours:
        conditions |= {("terminal", behaviour.terminal.name), ("error", behaviour.error.name)}
    lets, memory = _referenced(subsystem)
    memory |= {a.name for f in subsystem.functions for a in f.assignments if not a.peer}
    yield from (("behaviour", b) for b in subsystem.behaviours if b.name not in behaviours)
    yield from (("function", f) for f in subsystem.functions if f.name not in functions)
    for condition in subsystem.conditions:
        if (condition.kind, condition.name) not in conditions:
            yield f"{condition.kind} condition", condition
    yield from (("let", item) for item in subsystem.lets if item.name not in lets)
    unused = (m for m in subsystem.memory if m.name not in memory and m.name not in watched)
    yield from (("memory element", m) for m in unused)


def _referenced(subsystem: Subsystem) -> tuple[set[str], set[str]]:
    """Names of lets and of memory elements that expressions refer to."""
    lets: set[str] = set()
    memory: set[str] = set()
    expressions = [
        *(item.value for item in subsystem.lets),
        *(condition.when for condition in subsystem.conditions),
        *(a.value for f in subsystem.functions for a in f.assignments),
        *(axiom.that for axiom in subsystem.axioms),
    ]
    for expression in expressions:
        for node in walk(expression):
            if isinstance(node, LetRef):
                lets.add(node.name)
            elif isinstance(node, MemoryRef):
                memory.add(node.name)
    return lets, memory
