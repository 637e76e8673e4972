"""Types in generated code: annotations, named types, contracts."""

from __future__ import annotations

import re
from collections.abc import Callable

from specc.lang.kind import Python
from specc.lang.kinds import kind
from specc.lower.names import OWN_NAMES, Imports, NamedPlan, Namespace, identifier, literal
from specc.model.system import System, types_used
from specc.model.types import (
    Enum,
    Image,
    Opaque,
    Record,
    Type,
)

# The named types of a system, found in everything that has a type.


def named_types(system: System) -> tuple[tuple[str, Type], ...]:
    """Name and type of every enum and record in use, in the order of their declaration."""
    found: dict[Type, tuple[str, Type]] = {}
    for type_ in types_used(system):
        if name := getattr(type_, "name", ""):
            found.setdefault(frameless(type_), (name, type_))
    order = {named.name: index for index, named in enumerate(system.types)}
    # Of several with one name, each in another file, the first in the system keeps it.
    return tuple(sorted(found.values(), key=lambda t: (order.get(t[0], len(order)), t[0])))


# Annotations: the Python type of every type of the language.


class PythonTypes:
    """Names of the system's own types, the same in all its modules."""

    def __init__(self, types: tuple[tuple[str, Type], ...]) -> None:
        names = Namespace(OWN_NAMES)
        self.names: dict[Type, str] = {}
        self.declared: list[tuple[str, Type]] = []
        for name, type_ in types:
            if isinstance(type_, Opaque) and not type_.python:
                continue  # the types of its values are not known
            if frameless(type_) not in self.names:
                self.names[frameless(type_)] = names.new(name)
                if not getattr(type_, "python", ""):
                    self.declared.append((self.names[frameless(type_)], type_))


def frameless(type_: Type) -> Type:
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
        return kind(type_).annotation(
            type_, Python(self.of, self._imports.runtime_name, self._named)
        )

    def _named(self, type_: Type) -> str:
        name = self._names.names.get(frameless(type_))
        python = getattr(type_, "python", "")
        if python:
            module, _, attribute = python.partition(":")
            return self._imports.add(module, attribute, name or identifier(attribute))
        if name is not None:
            return self._imports.add(self._own_module, name) if self._own_module else name
        if isinstance(type_, Enum):
            self._imports.runtime_name("Literal")
            return literal_type(type_)
        if isinstance(type_, Opaque):
            return self._imports.runtime_name("Any")
        raise TypeError(f"no annotation for {type_!r}")


def literal_type(enum: Enum) -> str:
    """`Literal["u", "c"]`."""
    return f"Literal[{', '.join(map(literal, enum.members))}]"


# Contracts: how generated code checks what comes from outside against its declared type.


_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


def _is_replaceable(type_: Type) -> bool:
    """Whether something else may represent a value: an image, or what has a class."""
    return isinstance(type_, Image) or hasattr(type_, "python")


class Contracts:
    """Contracts for one module; those of enums and records get a name there, in `plans`."""

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
        self.plans: list[NamedPlan] = []
        self._names: dict[Type, str] = {}
        self._imports = imports
        self._python = Python(self.of, imports.runtime_name, annotations.of)
        self._new_name = new_name

    def of(self, type_: Type) -> str:
        """The contract of a type, as an expression."""
        if self._stand_ins and _is_replaceable(type_):
            return self._imports.runtime_name("as_any")
        if not isinstance(type_, Enum | Record):
            return kind(type_).contract(type_, self._python)
        key = frameless(type_)  # frames do not show in values
        if key not in self._names:
            value = kind(type_).contract(type_, self._python)
            words = _HUMP.sub("_", type_.name or "one_of").lower()
            self._names[key] = self._new_name(f"as_{words}")
            self.plans.append(NamedPlan(self._names[key], value))
        return self._names[key]
