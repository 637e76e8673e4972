"""The elements of a buffer, of a device or of an interface; safe values of those of devices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from specc.lang import Declaration
from specc.model.expr import Call, Expr, FileRef, MemoryRef, constant_names, walk
from specc.model.system import Element, SafeOutput
from specc.reachable import reachable
from specc.resolve.context import Where, duration_in, trace_of
from specc.resolve.expressions import Expressions
from specc.resolve.library import constant_scope
from specc.schema.files import DeviceDef
from specc.schema.subsystem import ElementDef, InputDef, ReceivedDef, SafeDef


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
            constants = constant_scope(expressions.definitions)
            scope = replace(constants, uninitialized=expressions.later)
            init = expressions.value(at["init"], definition.init, scope, type_, at.key)
        trace = trace_of(definition)
        is_received = isinstance(definition, ReceivedDef)
        age = duration_in(definition, at, "max_age", expressions.findings) if is_received else None
        event = isinstance(definition, InputDef) and definition.event
        title = definition.title
        found.append(Element(name, type_, init, title, trace, at.key, age, event=event))
    return tuple(found)


# What a device gets when a run ends: an expression over what the device reported last.


def with_safe(
    accepted: tuple[Element, ...],
    definition: DeviceDef,
    where: Where,
    reported: tuple[Element, ...],
    expressions: Expressions,
) -> tuple[Element, ...]:
    """What the device accepts, with the safe values that are declared in `where`, its `x`."""
    found = []
    for element in accepted:
        own = definition.x.elements.get(element.name)
        declared = own.safe if own else None
        if declared is None:
            found.append(element)
            continue
        at = where[element.name]["safe"]
        safe = _safe(declared, at, element, reported, expressions)
        found.append(replace(element, safe=safe))
    return tuple(found)


def _safe(
    declared: SafeDef,
    at: Where,
    element: Element,
    reported: tuple[Element, ...],
    expressions: Expressions,
) -> SafeOutput | None:
    constants = constant_scope(expressions.definitions)
    scope = replace(constants, memory={e.name: Declaration(e.type, e.place) for e in reported})
    here = at.scalar("is")
    value = expressions.value(here, declared.value, scope, element.type, element.place)
    otherwise = None
    if declared.otherwise is not None:
        there = at["otherwise"]
        otherwise = expressions.value(
            there, declared.otherwise, constants, element.type, element.place
        )
        if otherwise is not None and _may_fail(otherwise, expressions):
            message = "this is sent if `safe` fails, so it must not be able to fail itself"
            help_text = "write numbers, or constants that no operator computes"
            expressions.findings.report("E0412", message, there.place, help=help_text)
    elif value is not None and _may_fail(value, expressions):
        message = f"`safe` of `{element.name}` may fail, and nothing says what is sent then"
        help_text = "add `otherwise:` with a constant: `safe: {is: ..., otherwise: ...}`"
        expressions.findings.report("E0412", message, here.place, help=help_text)
    return SafeOutput(value, otherwise, at.key) if value is not None else None


def _may_fail(value: Expr, expressions: Expressions) -> bool:
    """Whether it calls an operator, reads a file, or asks for what may never have been reported."""
    constants = expressions.definitions.constants

    def used(part: Expr) -> list[str]:
        return [name for name in constant_names(part) if name in constants]

    names = reachable(used(value), lambda name: used(constants[name].value))
    parts = (value, *(constants[name].value for name in names))
    return any(isinstance(node, Call | FileRef | MemoryRef) for p in parts for node in walk(p))
