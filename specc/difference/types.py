"""Changes of named types, each reported once and not wherever the type is used."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from specc.difference.record import Book
from specc.model.system import System
from specc.model.types import Enum, ListOf, Opaque, OptionalOf, Record, Type, Vector


def type_text(type: Type) -> str:
    """A type as it is written; the members of an enum without a name are in alphabetical order."""
    match type:
        case Enum(name=""):
            return str(replace(type, members=tuple(sorted(type.members))))
        case Vector(element=Enum(name="") as enum):
            return str(replace(type, element=replace(enum, members=tuple(sorted(enum.members)))))
        case ListOf(element=element, nonempty=nonempty):
            return f"{'nonempty' if nonempty else 'list'}[{type_text(element)}]"
        case OptionalOf(value=value):
            return f"optional[{type_text(value)}]"
    return str(type)


def compare_types(old: System, new: System, book: Book) -> None:
    """Members of enums, fields of records and Python classes of the types that both systems use."""
    before, after = _named(old), _named(new)
    for name in sorted(before.keys() & after.keys()):
        parts = before[name], after[name]
        for key in sorted(parts[0].keys() | parts[1].keys()):
            texts = [part.get(key, "") for part in parts]
            if not texts[0]:
                book.added("type", name, f"{key} {texts[1]}".strip())
            elif not texts[1]:
                book.removed("type", name, f"{key} {texts[0]}".strip())
            else:
                book.changed("type", name, key, *texts)


def _named(system: System) -> dict[str, dict[str, str]]:
    """What each named type consists of, by part."""
    found: dict[str, dict[str, str]] = {}
    for type in sorted(set(_types(system)), key=str):
        match type:
            case Enum(name=name, members=members) if name:
                found.setdefault(name, {f"member {m}": "-" for m in members})
            case Record(name=name, fields=fields, python=python):
                parts = {f"field {field}": type_text(t) for field, t in fields}
                found.setdefault(name, parts | {"class": python or "generated"})
            case Opaque(name=name, python=python):
                found.setdefault(name, {"class": python or "not said"})
    return found


def _types(system: System) -> Iterator[Type]:
    """All types of the system with the types inside them."""
    roots: list[Type] = []
    for device in system.devices:
        roots += [element.type for element in (*device.x, *device.y)]
    for subsystem in system.subsystems:
        roots += [element.type for port in subsystem.ports for element in port.elements]
        roots += [memory.type for memory in subsystem.memory]
    for operator in system.operators:
        roots += [*(type for _, type in operator.parameters), operator.result]
    seen: set[Type] = set()
    while roots:
        type = roots.pop()
        if type in seen:
            continue
        seen.add(type)
        yield type
        match type:
            case ListOf(element=element) | Vector(element=element) | OptionalOf(value=element):
                roots.append(element)
            case Record(fields=fields):
                roots += [field for _, field in fields]
