"""Types in generated code: annotations, named types, contracts."""

from __future__ import annotations

import re
from collections.abc import Callable

from specc.lower.names import OWN_NAMES, Imports, NamedPlan, Namespace, identifier, literal
from specc.model.system import System, types_used
from specc.model.types import (
    Bool,
    Enum,
    File,
    Image,
    Int,
    ListOf,
    Opaque,
    OptionalOf,
    PartialOf,
    Pose,
    Real,
    Record,
    Spatial,
    Text,
    Type,
    Vector,
    whole,
)

# The named types of a system, found in everything that has a type.


def named_types(system: System) -> tuple[tuple[str, Type], ...]:
    """Name and type of every enum and record in use, in the order of their declaration."""
    found: dict[Type, tuple[str, Type]] = {}
    for type_ in types_used(system):
        if isinstance(type_, Enum | Opaque | Record) and type_.name:
            found.setdefault(plain(type_), (type_.name, type_))
    order = {named.name: index for index, named in enumerate(system.types)}
    # Of several with one name, each in another file, the first in the system keeps it.
    return tuple(sorted(found.values(), key=lambda t: (order.get(t[0], len(order)), t[0])))


# Annotations: the Python type of every type of the language.


class PythonTypes:
    """Names of the system's own types, the same in all its modules."""

    def __init__(self, types: tuple[tuple[str, Type], ...]) -> None:
        names = Namespace(OWN_NAMES)
        self.of: dict[Type, str] = {}
        self.declared: list[tuple[str, Type]] = []
        for name, type_ in types:
            if isinstance(type_, Opaque) and not type_.python:
                continue  # the types of its values are not known
            if isinstance(type_, (Enum, Record, Opaque)) and plain(type_) not in self.of:
                self.of[plain(type_)] = names.new(name)
                if not getattr(type_, "python", ""):
                    self.declared.append((self.of[plain(type_)], type_))


def plain(type_: Type) -> Type:
    """A type without frames: Python does not tell `Object[K]` from `Object[B]`."""
    return type_.framed(lambda frame: "")


class Annotations:
    """Annotations for one module; what they need is imported."""

    def __init__(self, imports: Imports, names: PythonTypes, own_module: str = ".types") -> None:
        self._imports = imports
        self._names = names
        self._own_module = own_module

    def of(self, type_: Type) -> str:
        """The annotation of a type."""
        type_ = whole(type_)
        plain_name = _PYTHON.get(type(type_))
        if plain_name:
            return plain_name
        if value_name := _value_name(type_):
            return self._imports.own(value_name)
        if isinstance(type_, (Vector, ListOf)):
            return f"tuple[{self.of(type_.element)}, ...]"
        if isinstance(type_, OptionalOf):
            return f"{self.of(type_.value)} | None"
        return self._named(type_)

    def _named(self, type_: Type) -> str:
        name = self._names.of.get(plain(type_))
        python = getattr(type_, "python", "")
        if python:
            module, _, attribute = python.partition(":")
            return self._imports.add(module, attribute, name or identifier(attribute))
        if name is not None:
            return self._imports.add(self._own_module, name) if self._own_module else name
        if isinstance(type_, Enum):
            self._imports.own("Literal")
            return literal_type(type_)
        if isinstance(type_, Opaque):
            return self._imports.own("Any")
        raise TypeError(f"no annotation for {type_!r}")


_PYTHON: dict[type[Type], str] = {
    Bool: "bool",
    File: "str",
    Int: "int",
    Real: "float",
    Text: "str",
}


def _value_name(type_: Type) -> str:
    """The runtime's name for arrays of a type; "" for a type that is not an array."""
    match type_:
        case Vector(element=Real()):
            return "Vector"
        case Spatial():
            return "Spatial"
        case Pose():
            return "Pose"
        case Image(channels=channels):
            return "Rgb" if channels == 3 else "Depth"
    return ""


def literal_type(enum: Enum) -> str:
    """`Literal["u", "c"]`."""
    return f"Literal[{', '.join(map(literal, enum.members))}]"


# Contracts: how generated code checks what comes from outside against its declared type.


_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")
_PLAIN: dict[type[Type], str] = {
    Bool: "as_bool",
    File: "as_text",
    Int: "as_int",
    Pose: "as_pose",
    Real: "as_real",
    Text: "as_text",
}


class Contracts:
    """Contracts for one module; those of enums and records get a name there, in `named`."""

    def __init__(
        self,
        imports: Imports,
        annotations: Annotations,
        new_name: Callable[[str], str],
        *,
        stand_ins: bool = False,
    ) -> None:
        """`stand_ins`: images and what has a class are represented by something else."""
        self._stand_ins = stand_ins
        self.named: list[NamedPlan] = []
        self._names: dict[Type, str] = {}
        self._imports = imports
        self._annotations = annotations
        self._new_name = new_name

    def of(self, type_: Type) -> str:
        """The contract of a type, as an expression."""
        if name := _PLAIN.get(type(type_)):
            return self._imports.own(name)
        if self._stand_ins and isinstance(type_, Image | Opaque | Record):
            return self._imports.own("as_any")
        if isinstance(type_, Enum | Record):
            return self._own(type_)
        return self._made(*self._call(type_))

    def _call(self, type_: Type) -> tuple[str, ...]:
        match type_:
            case Vector(size=size, element=Real()):
                return "as_vector", literal(size)
            case PartialOf(value=value):
                return "as_partial", literal(value.size if isinstance(value, Vector) else 6)
            case Spatial():
                return "as_vector", "6"
            case Vector(size=size, element=element):
                return "as_tuple", self.of(element), literal(size)
            case ListOf(element=element, nonempty=nonempty):
                return "as_list", self.of(element), *["least=1"] * nonempty
            case OptionalOf(value=value):
                return "as_optional", self.of(value)
            case Image(height=height, width=width, channels=channels):
                kind = "as_rgb" if channels == 3 else "as_depth"
                return kind, literal(height), literal(width)
            case Opaque(python=python):
                return "as_instance", self._annotations.of(type_) if python else "object"
        raise TypeError(f"no contract for {type_!r}")

    def _made(self, name: str, *arguments: str) -> str:
        return f"{self._imports.own(name)}({', '.join(arguments)})"

    def _own(self, type_: Enum | Record) -> str:
        key = plain(type_)  # frames do not show in values
        if key not in self._names:
            if isinstance(type_, Enum):
                value = self._made("as_member", *map(literal, type_.members))
            else:
                fields = (f"{name}={self.of(part)}" for name, part in type_.fields)
                value = self._made("as_record", self._annotations.of(type_), *fields)
            words = _HUMP.sub("_", type_.name or "one_of").lower()
            self._names[key] = self._new_name(f"as_{words}")
            self.named.append(NamedPlan(self._names[key], value))
        return self._names[key]
