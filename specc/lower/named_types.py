"""The named types of a system, found in everything that has a type."""

from __future__ import annotations

from collections.abc import Iterator

from specc.model.system import System
from specc.model.types import Enum, ListOf, Opaque, OptionalOf, Record, Type, Vector


def named_types(system: System) -> tuple[tuple[str, Type], ...]:
    """Name and type of every enum and record in use, in the order of their declaration."""
    found: dict[str, Type] = {}
    pending = list(_types(system))[::-1]
    while pending:
        type_ = pending.pop()
        match type_:
            case ListOf(element=element) | Vector(element=element) | OptionalOf(value=element):
                pending.append(element)
            case Enum(name=name) | Opaque(name=name):
                found.setdefault(name, type_)
            case Record(name=name, fields=fields) if name not in found:
                found[name] = type_
                pending.extend(inner for _, inner in fields)
    order = {name: index for index, (name, _) in enumerate(system.types)}
    names = sorted(filter(None, found), key=lambda name: (order.get(name, len(order)), name))
    return tuple((name, found[name]) for name in names)


def _types(system: System) -> Iterator[Type]:
    for operator in system.operators:
        yield from (type_ for _, type_ in operator.parameters)
        yield operator.result
    for constant in system.constants:
        yield constant.value.type
    for subsystem in system.subsystems:
        yield from (element.type for port in subsystem.ports for element in port.elements)
        yield from (item.type for item in subsystem.memory)
        yield from (let.value.type for let in subsystem.lets)
        yield from (constant.value.type for constant in subsystem.constants)
