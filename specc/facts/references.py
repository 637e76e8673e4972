"""What the expressions of a subsystem refer to."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from specc.model.expr import ConstantRef, Expr, Fresh, Input, walk
from specc.model.system import Subsystem
from specc.proof import InputName


def expressions(subsystem: Subsystem) -> Iterator[Expr]:
    """Every expression of a subsystem, parameters and initial values included."""
    for port in subsystem.ports:
        yield from (e.init for e in port.elements if e.init is not None)
    yield from (constant.value for constant in subsystem.constants)
    yield from (memory.init for memory in subsystem.memory)
    yield from (item.value for item in subsystem.lets)
    yield from (condition.when for condition in subsystem.conditions)
    yield from (a.value for f in subsystem.functions for a in f.assignments)
    yield from (axiom.that for axiom in subsystem.axioms)


def inputs_read(subsystem: Subsystem) -> frozenset[InputName]:
    """Inputs whose value or arrival some expression asks for."""
    return frozenset(
        (node.peer, node.element)
        for expression in expressions(subsystem)
        for node in walk(expression)
        if isinstance(node, Input)
    )


def arrivals_asked(subsystem: Subsystem) -> frozenset[InputName]:
    """Inputs of which it matters whether a new value has come."""
    return frozenset(
        (node.input.peer, node.input.element)
        for expression in expressions(subsystem)
        for node in walk(expression)
        if isinstance(node, Fresh)
    )


def names_any(expr: Expr, constants: Collection[str]) -> bool:
    """Whether an expression refers to one of some constants or parameters."""
    if not constants:
        return False
    return any(isinstance(node, ConstantRef) and node.name in constants for node in walk(expr))
