"""The Python that a system names: what runs although no specification has its text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, Literal

from specc.analysis.plant import bindable
from specc.lower.module import frameless
from specc.model.bindings import Binding
from specc.model.system import Operator, Plant, System
from specc.model.task import Task
from specc.model.types import Opaque, Record, Type
from specc.source import Place


@dataclass(frozen=True, slots=True)
class PythonObject:
    """An object of Python, `module:name`, and as what a system names it.

    `name` is that of the operator, the type or the element; the plant, the scene and the judge have
    none. `signature` has what goes into it and comes out, by names; those of a type are its fields.
    """

    python: str
    part: Literal["operator", "type", "codec", "through", "plant", "scene", "judge"]
    name: str = ""
    signature: tuple[tuple[str, Type], ...] = ()

    def __str__(self) -> str:
        words = f"{self.python} as {self.part} {self.name}".strip()
        return words + (f" ({_signature_text(self.signature)})" if self.signature else "")


def _signature_text(signature: tuple[tuple[str, Type], ...]) -> str:
    return ", ".join(f"{name}: {type_}" if name else f"-> {type_}" for name, type_ in signature)


def named_code(system: System) -> frozenset[PythonObject]:
    """All Python objects that a resolved system names."""
    return frozenset(
        named for part in _records(system) for named in _objects_named_by(part, system)
    )


def _objects_named_by(part: object, system: System) -> Iterator[PythonObject]:
    match part:
        case Operator(python=python, name=name, parameters=parameters, result=result) if python:
            yield PythonObject(python, "operator", name, (*parameters, ("", result)))
        case Record(python=python, name=name, fields=inside) if python:
            yield PythonObject(
                python, "type", name, tuple((n, frameless(type_)) for n, type_ in inside)
            )
        case Opaque(python=python, name=name, codec=codec):
            yield from [PythonObject(python, "type", name)] if python else []
            each = zip(_CODEC, codec, strict=bool(codec))
            yield from (
                PythonObject(function, "codec", f"{name}.{verb}") for verb, function in each
            )
        case Binding(through=through) if through:
            known = {(device, e.name): e.type for device, e, _ in bindable(system)}
            name, type_ = f"{part.device}.{part.element}", known[part.device, part.element]
            yield PythonObject(through, "through", name, (("", type_),))
        case Plant(python=python) if python:
            yield PythonObject(python, "plant")
        case Task(scene=scene, judge=judge):
            yield from [PythonObject(scene, "scene")] if scene else []
            yield from [PythonObject(judge, "judge")] if judge else []


_CODEC = "encode", "decode"


def _records(whole: object) -> Iterator[object]:
    """Yield all dataclasses in a value, each once, so that new fields are found as well."""
    seen, waiting = set[int](), [whole]
    while waiting:
        part: Any = waiting.pop()
        if isinstance(part, tuple | frozenset):
            waiting += part
        elif isinstance(part, Mapping):
            waiting += part.values()
        elif is_dataclass(part) and not isinstance(part, Place) and id(part) not in seen:
            seen.add(id(part))
            yield part
            waiting += [getattr(part, field.name) for field in fields(part)]
