"""A plan is a template and the texts that fill it in, in order and already spelled."""

from __future__ import annotations

from collections.abc import Mapping

from specc.frozen import frozen


@frozen
class FilePlan:
    """A generated file: the name of its template, and what each name in the template stands for."""

    template: str
    parts: Mapping[str, object]


@frozen
class ConstantPlan:
    """A constant. `is_computed`: an operator or a file gives it, so the class holds it."""

    name: str
    annotation: str
    value: str
    comment: str
    is_computed: bool


@frozen
class NamedPlan:
    """A name at the top of a module and its value: an enum, a contract, an operator."""

    name: str
    value: str


@frozen
class AttributePlan:
    """An attribute of a buffer or of the memory, or a field of a record."""

    name: str
    annotation: str
    comment: str


@frozen
class MethodPlan:
    """A method; `lines` carry their indentation relative to its body."""

    name: str
    parameters: tuple[str, ...]
    returns: str
    doc: str
    lines: tuple[str, ...]
