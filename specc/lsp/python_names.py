"""Which names of a specification Python code relies on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass

from specc.model.system import System
from specc.model.types import Enum, Type


def enums_in_python(system: System) -> dict[str, str]:
    """Enums that reach Python code, which knows their members by name, each with that code."""
    found: dict[str, str] = {}
    for type_, code in _crossing(system):
        for enum in _enums(type_):
            found.setdefault(enum.name, code)
    return found


def _crossing(system: System) -> Iterator[tuple[Type, str]]:
    """Types of what goes to operators and to the functions of the plant, or comes from them."""
    for operator in system.operators:
        for type_ in (operator.result, *(type_ for _, type_ in operator.parameters)):
            yield type_, f"operator `{operator.name}`"
    for device in system.devices:
        for element in (*device.x, *device.y):
            yield element.type, f"the plant, by `{device.qualified_name}.{element.name}`"
    watched = system.task.watch if system.task else ()
    for subsystem in system.subsystems:
        for memory in subsystem.memory:
            if memory.name in watched:
                yield memory.type, "the judge of the task"


def _enums(part: object) -> Iterator[Enum]:
    """The enums in a type, which is made of other types and of tuples of them."""
    if isinstance(part, Enum):
        yield part
    elif isinstance(part, tuple):
        for item in part:
            yield from _enums(item)
    elif is_dataclass(part):
        for field in fields(part):
            yield from _enums(getattr(part, field.name))
