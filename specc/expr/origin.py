"""How an expression got its type: the declarations that gave it, for the reader of a mismatch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from specc.expr.scope import Scope
from specc.model.expr import (
    Binary,
    Builtin,
    Call,
    Choice,
    Component,
    ConstantRef,
    Expr,
    FieldOf,
    Input,
    LetRef,
    MemoryRef,
    Unary,
)
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Origin:
    """A place that gave a type, and what it says in words."""

    place: Place
    words: str


def origins(expr: Expr, scope: Scope) -> Iterator[Origin]:
    """The declarations from which the type of `expr` follows, from left to right."""
    match expr:
        case MemoryRef(name=name):
            yield from _declared(name, expr, scope)
        case Input(peer=peer, element=element):
            yield from _declared(f"x.{peer}.{element}", expr, scope)
        case LetRef(name=name) | ConstantRef(name=name):
            yield from _named(name, expr, scope)
        case Call(operator=name) if name in scope.operators:
            yield Origin(scope.operators[name].place, f"`{name}` returns `{expr.type}`")
        case Binary(left=left, right=right):
            yield from origins(left, scope)
            yield from origins(right, scope)
        case Unary(operand=value) | FieldOf(value=value) | Component(value=value):
            yield from origins(value, scope)
        case Choice(then=value) | Builtin(args=(value, *_)):
            yield from origins(value, scope)


def _declared(name: str, expr: Expr, scope: Scope) -> Iterator[Origin]:
    if name in scope.declared:
        yield Origin(scope.declared[name].place, f"`{name}` is declared as `{expr.type}`")


def _named(name: str, expr: Expr, scope: Scope) -> Iterator[Origin]:
    """A name takes its type from what it stands for, or from a parameter's declaration."""
    if name not in scope.declared:
        return
    declaration = scope.declared[name]
    because = ""
    if isinstance(declaration.value, Call):
        because = f" because `{declaration.value.operator}` returns it"
    yield Origin(declaration.place, f"`{name}` is `{expr.type}`{because}")
