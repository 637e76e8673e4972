"""What a device gets when a run ends: an expression over what the device reported last."""

from __future__ import annotations

from dataclasses import replace

from specc.expr import Declared
from specc.model.expr import Call, ConstantRef, Expr, FileRef, MemoryRef, walk
from specc.model.system import Element, Safe
from specc.resolve.context import Where
from specc.resolve.expressions import Expressions
from specc.resolve.library import constant_scope
from specc.schema.files import DeviceDef
from specc.schema.subsystem import SafeDef


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
        declared = definition.x[element.name].safe
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
) -> Safe | None:
    constants = constant_scope(expressions.definitions)
    scope = replace(
        constants,
        memory={e.name: e.type for e in reported},
        declared={**constants.declared, **{e.name: Declared(e.place) for e in reported}},
    )
    here = at.scalar("is")
    value = expressions.value(here, declared.value, scope, element.type, element.place)
    otherwise = None
    if declared.otherwise is not None:
        there = at["otherwise"]
        otherwise = expressions.value(
            there, declared.otherwise, constants, element.type, element.place
        )
        if otherwise is not None and _may_fail(otherwise, expressions):
            message = "what is sent where `safe` fails must not fail itself"
            help_text = "write numbers, or constants that no operator computes"
            expressions.findings.report("E0412", message, there.place, help=help_text)
    elif value is not None and _may_fail(value, expressions):
        message = f"`safe` of `{element.name}` may fail, and nothing says what is sent then"
        help_text = "add `otherwise:` with a constant: `safe: {is: ..., otherwise: ...}`"
        expressions.findings.report("E0412", message, here.place, help=help_text)
    return Safe(value, otherwise, at.key) if value is not None else None


def _may_fail(value: Expr, expressions: Expressions) -> bool:
    """Whether it calls an operator, reads a file, or asks for what may never have been reported."""
    constants = expressions.definitions.constants
    pending, seen = [value], set[str]()
    while pending:
        for node in walk(pending.pop()):
            if isinstance(node, Call | FileRef | MemoryRef):
                return True
            if isinstance(node, ConstantRef) and node.name in constants and node.name not in seen:
                seen.add(node.name)
                pending.append(constants[node.name].value)
    return False
