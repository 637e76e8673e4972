"""Contracts: how generated code checks what comes from outside against its declared type."""

from __future__ import annotations

import re
from collections.abc import Callable

from specc.lower.annotations import Annotations, plain
from specc.lower.imports import Imports
from specc.lower.plan import NamedPlan
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
    PartialOf,
    Pose,
    Real,
    Record,
    Spatial,
    Text,
    Type,
    Vector,
)

RUNTIME = "specc_runtime.contracts"
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
            return self._imports.add(RUNTIME, name)
        if self._stand_ins and isinstance(type_, Image | Opaque | Record):
            return self._imports.add(RUNTIME, "as_any")
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
        return f"{self._imports.add(RUNTIME, name)}({', '.join(arguments)})"

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
