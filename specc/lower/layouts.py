"""How the values of a system look in recordings: the forms of all elements, by subsystem."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.lang.kind import Python
from specc.lang.kinds import kind
from specc.lower.annotations import Annotations, PythonTypes
from specc.lower.module import Module, buffer_names, memory_names
from specc.lower.names import (
    OWN_NAMES,
    FilePlan,
    Functions,
    Imports,
    NamedPlan,
    Namespace,
    identifier,
    in_docstring,
    literal,
)
from specc.model.binding import PLANT
from specc.model.system import Element, Memory, Subsystem, System
from specc.model.types import (
    Record,
    Type,
)


class _Forms:
    """Forms for the module; those of records get a name there, in `plans`."""

    def __init__(self, types: PythonTypes, names: Namespace) -> None:
        self.imports = Imports()
        self.plans: list[NamedPlan] = []
        self._python = Python(
            self.of,
            lambda name: f"forms.{name}",
            Annotations(self.imports, types).of,
            Functions(self.imports, names).use,
        )
        self._names = names
        self._known: dict[str, str] = {}

    def of(self, type_: Type) -> str:
        """The form of a type, as an expression."""
        text = kind(type_).form(type_, self._python)
        if not isinstance(type_, Record):
            return text
        if text not in self._known:
            self._known[text] = self._names.new(identifier(type_.name).upper())
            self.plans.append(NamedPlan(self._known[text], text))
        return self._known[text]


@dataclass(frozen=True, slots=True)
class _Layout:
    groups: tuple[tuple[str, tuple[str, ...]], ...]
    ends: tuple[tuple[str, str], ...]


def layouts_plan(system: System, types: PythonTypes) -> FilePlan:
    """The module of layouts; subsystems of one kind share theirs."""
    names = Namespace((*OWN_NAMES, *types.names.values()))
    forms = _Forms(types, names)
    known: dict[_Layout, str] = {}
    owners = []
    for subsystem in system.subsystems:
        layout = _layout(system, subsystem, types, forms)
        if layout not in known:
            known[layout] = names.new(identifier(subsystem.qualified_name).upper())
        owners.append((literal(subsystem.qualified_name), known[layout]))
    if system.plant and system.plant.observed:
        observed = (((item.name,), f"{PLANT}.{item.name}", item) for item in system.plant.observed)
        groups = ("x", ()), ("y", tuple(_elements(observed, forms))), ("memory", ())
        layout = _Layout(groups, ())
        known[layout] = names.new(PLANT.upper())
        owners.append((literal(PLANT), known[layout]))
    parts = {
        "imports": forms.imports.lines,
        "records": forms.plans,
        "layouts": tuple((name, layout) for layout, name in known.items()),
        "subsystems": tuple(owners),
    }
    return FilePlan("layouts.py.j2", parts)


def _layout(system: System, subsystem: Subsystem, types: PythonTypes, forms: _Forms) -> _Layout:
    methods = Module(system, subsystem, types).state_methods
    memory = memory_names(subsystem)
    memory_elements = (((item.name,), memory[item.name], item) for item in subsystem.memory)
    groups = (
        ("x", tuple(_elements(_buffer(subsystem.inputs), forms))),
        ("y", tuple(_elements(_buffer(subsystem.outputs), forms))),
        ("memory", tuple(_elements(memory_elements, forms))),
    )
    ends = (
        (
            literal(s.name),
            literal((*(c.name for _, c in s.behaviour.endings[::-1]), methods[s.name])),
        )
        for s in subsystem.states
    )
    return _Layout(groups, tuple(ends))


_NamedElement = tuple[tuple[str, ...], str, Element | Memory]


def _buffer(elements: dict[tuple[str, str], Element]) -> Iterator[_NamedElement]:
    attributes = buffer_names(elements)
    return ((name, attributes[name], element) for name, element in elements.items())


def _elements(named: Iterable[_NamedElement], forms: _Forms) -> Iterator[str]:
    for name, attribute, item in named:
        description = ", ".join(filter(None, (str(item.type), in_docstring(item.title))))
        texts = (literal(attribute), literal(name), forms.of(item.type), literal(description))
        yield ", ".join(texts)
