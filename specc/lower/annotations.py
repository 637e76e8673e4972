"""Annotations: the Python type of every type of the language."""

from __future__ import annotations

from specc.lower.imports import Imports
from specc.lower.names import OWN_NAMES, Names, identifier
from specc.lower.text import literal
from specc.model.types import (
    Bool,
    Enum,
    File,
    Image,
    Int,
    ListOf,
    Opaque,
    OptionalOf,
    Pose,
    Real,
    Record,
    Spatial,
    Text,
    Type,
    Vector,
    whole,
)

VALUES = "specc_runtime.values"


class TypeNames:
    """Names of the system's own types, the same in all its modules."""

    def __init__(self, types: tuple[tuple[str, Type], ...]) -> None:
        names = Names(OWN_NAMES)
        self.of: dict[Type, str] = {}
        self.declared: list[tuple[str, Type]] = []
        for name, type_ in types:
            if isinstance(type_, Opaque) and not type_.python:
                continue  # nobody says what its values are
            if isinstance(type_, (Enum, Record, Opaque)) and plain(type_) not in self.of:
                self.of[plain(type_)] = names.new(name)
                if not getattr(type_, "python", ""):
                    self.declared.append((self.of[plain(type_)], type_))


def plain(type_: Type) -> Type:
    """A type without frames: Python does not tell `Object[K]` from `Object[B]`."""
    match type_:
        case Record(name=name, python=python) if python:
            return Opaque(name, (), python)
        case Record(name=name):
            return Record(name, (), ())
        case Opaque(name=name, python=python):
            return Opaque(name, (), python)
    return type_


class Annotations:
    """Annotations for one module; what they need is imported."""

    def __init__(self, imports: Imports, names: TypeNames, own_module: str = ".types") -> None:
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
            return self._imports.add(VALUES, value_name)
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
            self._imports.add("typing", "Literal")
            return literal_type(type_)
        if isinstance(type_, Opaque):
            return self._imports.add("typing", "Any")
        raise TypeError(f"no annotation for {type_!r}")


_PYTHON: dict[type[Type], str] = {
    Bool: "bool",
    File: "str",
    Int: "int",
    Real: "float",
    Text: "str",
}


def _value_name(type_: Type) -> str:
    """The runtime's name for arrays of a type; "" for what is no array."""
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
