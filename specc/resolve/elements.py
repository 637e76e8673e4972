"""The elements of a buffer, of a device or of an interface."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

from specc.model.system import Element
from specc.resolve.context import Where, duration_of, trace_of
from specc.resolve.expressions import Expressions
from specc.resolve.library import constant_scope
from specc.schema.subsystem import ElementDef, InputDef


def resolve_elements(
    elements: Mapping[str, ElementDef], where: Where, expressions: Expressions
) -> tuple[Element, ...]:
    """The elements of one buffer; one whose type is wrong is left out and marked as broken."""
    found = []
    for name, definition in elements.items():
        at = where[name]
        type_ = expressions.type(at.scalar("type"), definition.type)
        if type_ is None:
            expressions.broken.add(name)
            continue
        init = None
        if definition.init is not None:
            scope = replace(constant_scope(expressions.definitions), later=expressions.later)
            init = expressions.value(at["init"], definition.init, scope, type_, at.key)
        trace = trace_of(definition)
        age = _max_age(definition, at, expressions)
        found.append(Element(name, type_, init, definition.title, trace, at.key, age))
    return tuple(found)


def _max_age(definition: ElementDef, at: Where, expressions: Expressions) -> Fraction | None:
    if not isinstance(definition, InputDef) or definition.max_age is None:
        return None
    return duration_of(definition.max_age, at["max_age"], expressions.findings)
