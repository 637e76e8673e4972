"""What is known, at every tick of a run, of the values that formulas of requirements name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from specc.analysis.machine import Machine
from specc.model.expr import Compare, Expr, Member, MemoryRef, map_children
from specc.model.requirement import Reading
from specc.model.system import System
from specc.model.types import Bool, Enum


def known_of_readings(system: System, machines: Mapping[str, Machine]) -> Iterator[Expr]:
    """Conditions on them; `machines` are those of which enough is known.

    What is always there is present, and memory has what is written to it. That a state is never
    reached is told of the state (W0607), and not again of each formula that names it.
    """
    for reading in {r.name: r for item in system.formulas for r in item.readings}.values():
        machine = machines.get(reading.subsystem)
        value = MemoryRef(reading.name, type=reading.type)
        if reading.asks_presence:
            if reading.kind in ("state", "memory") or reading.initial:
                yield value
        elif reading.kind == "memory" and machine:
            known = machine.memory_facts.conditions.get(reading.element[0])
            if known is not None:
                yield _said_of(reading, known)


def _said_of(reading: Reading, known: Expr) -> Expr:
    """What is known of memory, of the reading of it."""
    if isinstance(known, MemoryRef):
        return MemoryRef(reading.name, type=known.type)
    return map_children(known, lambda part: _said_of(reading, part))


def begins_in(reading: Reading, system: System) -> Expr | None:
    """That a subsystem is in the state that it has at the first tick."""
    if reading.kind != "state" or not isinstance(reading.type, Enum):
        return None
    found = {s.qualified_name: s.initial_state for s in system.subsystems if s.has_initial_state}
    state = found.get(reading.subsystem)
    if state not in reading.type.members:
        return None
    first = Member(state, type=reading.type)
    return Compare("==", MemoryRef(reading.name, type=reading.type), first, type=Bool())
