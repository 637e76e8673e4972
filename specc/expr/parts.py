"""Typing rules of dots and brackets: input elements, fields of records, components of vectors."""

from __future__ import annotations

import ast

from specc.diagnostics.nearest import nearest
from specc.expr.context import Context
from specc.expr.errors import ExprError, listed, one_of
from specc.expr.literals import quantity
from specc.expr.names import output_read
from specc.expr.parse import span
from specc.model.expr import Component, Expr, FieldOf, Input
from specc.model.types import (
    SPATIAL_COMPONENTS,
    VECTOR3_COMPONENTS,
    Opaque,
    Pose,
    Real,
    Record,
    Spatial,
    Type,
    Vector,
)


def attribute(ctx: Context, node: ast.Attribute, hint: Type | None) -> Expr:
    """`x.peer.element`, `record.field` or `vector.z`."""
    match node.value:
        case ast.Name(id="y") | ast.Attribute(value=ast.Name(id="y")):
            raise output_read(ctx, node)
        case ast.Name(id="x"):
            raise _whole_buffer(ctx, node)
        case ast.Attribute(value=ast.Name(id="x")):
            return input_element(ctx, node)
    value = ctx.infer(node.value)
    if isinstance(value.type, Record):
        return _field(ctx, node, value, value.type)
    names = _component_names(value.type)
    if node.attr in names:
        return _component(node, value, names.index(node.attr))
    raise _no_part(ctx, node, value.type, names).because(ctx.origins(value))


def subscript(ctx: Context, node: ast.Subscript, hint: Type | None) -> Expr:
    """`0.02[m/s]` or `v[2]`."""
    if isinstance(node.value, ast.Constant) and type(node.value.value) in (int, float):
        return quantity(ctx, node)
    value = ctx.infer(node.value)
    size = value.type.size if isinstance(value.type, Vector) else 6
    if not isinstance(value.type, (Vector, Spatial)):
        message = f"`{ctx.quote(node.value)}` is `{value.type}`, which has no components"
        error = ctx.error(node, message, "`all(...)` and `any(...)` go over a list", "E0234")
        raise error.because(ctx.origins(value))
    match node.slice:
        case ast.Constant(value=int(index)) if not isinstance(index, bool):
            if index < size:
                return _component(node, value, index)
            message = f"`{ctx.quote(node.value)}` has no component {index}"
            help = f"its components are 0 to {size - 1}, counted from 0"
            raise ctx.error(node.slice, message, help, "E0234")
    message = f"`{ctx.quote(node.slice)}` is no index: an index is a whole number, 0 or more"
    help = "`all(...)` and `any(...)` go over all components"
    raise ctx.error(node.slice, message, help, "E0234")


def input_element(ctx: Context, node: ast.expr) -> Input:
    """`x.peer.element` and nothing else."""
    match node:
        case ast.Attribute(value=ast.Attribute(value=ast.Name(id="x"), attr=peer), attr=element):
            pass
        case _:
            message = f"`{ctx.quote(node)}` is not an element of an input buffer"
            raise ctx.error(node, message, "it is spelt `x.peer.element`", "E0203")
    scope = ctx.scope
    if not scope.allow_inputs or not scope.known_peers():
        message = f"`{ctx.quote(node)}` has no value here: there are no inputs"
        raise ctx.error(node, message, "refer to constants and operators only", "E0230")
    type = scope.inputs.get((peer, element))
    if type is not None:
        return Input(peer, element, type=type, span=span(node))
    if peer not in scope.known_peers():
        known = scope.known_peers()
        error = _unknown(node.value, "there is no input buffer of ", peer, known, "E0204")
        way = f"declare it under `x:` here and under `y:` at its other end, `{peer}`"
        raise error.not_there(f"`x.{peer}` is not there yet", way, peer, known)
    known = list(scope.elements(peer))
    error = _unknown(node, f"input buffer `x.{peer}` has no ", element, known, "E0203")
    way = f"declare it under `x: {peer}:` here and under `y:` of what sends it, `{peer}`"
    raise error.not_there(f"`x.{peer}.{element}` is not there yet", way, element, known)


def _unknown(node: ast.expr, what: str, name: str, known: list[str], code: str) -> ExprError:
    end = span(node)[1]
    error = ExprError(f"{what}`{name}`", end - len(name), end, _suggestion(name, known), code)
    return error.meant(name, nearest(name, known))


def _suggestion(name: str, known: list[str]) -> str:
    close = nearest(name, known)
    if close:
        return f"did you mean {one_of(close)}?"
    return f"there {'is' if len(known) == 1 else 'are'} {listed(known)}" if known else ""


def _whole_buffer(ctx: Context, node: ast.Attribute) -> ExprError:
    known = ctx.scope.known_peers()
    if node.attr not in known:
        return _unknown(node, "there is no input buffer of ", node.attr, known, "E0204")
    listed = one_of(f"x.{node.attr}.{e}" for e in ctx.scope.elements(node.attr))
    message = f"`{ctx.quote(node)}` is a whole input buffer"
    return ctx.error(node, message, f"name an element: {listed}" if listed else "", "E0203")


def _field(ctx: Context, node: ast.Attribute, value: Expr, record: Record) -> Expr:
    type = record.field(node.attr)
    if type is not None:
        return FieldOf(value, node.attr, type=type, span=span(node))
    known = [name for name, _ in record.fields]
    error = _no_part(ctx, node, record, tuple(known)).because(ctx.origins(value))
    message = f"field `{node.attr}` of `{record}` is not there yet"
    raise error.not_there(message, "declare it under `fields:`", node.attr, known)


def _component_names(type: Type) -> tuple[str, ...]:
    if isinstance(type, Spatial) or (isinstance(type, Vector) and type.size == 6):
        return SPATIAL_COMPONENTS
    return VECTOR3_COMPONENTS if isinstance(type, Vector) and type.size == 3 else ()


def _component(node: ast.expr, value: Expr, index: int) -> Component:
    type: Type
    if isinstance(value.type, Spatial):
        type = Real(value.type.linear if index < 3 else value.type.angular)
    else:
        assert isinstance(value.type, Vector)  # callers looked
        type = value.type.element
    return Component(value, index, type=type, span=span(node))


def _no_part(ctx: Context, node: ast.Attribute, type: Type, known: tuple[str, ...]) -> ExprError:
    message = f"`{ctx.quote(node.value)}` is `{type}`, which has no `{node.attr}`"
    help = _suggestion(node.attr, list(known))
    peer = ctx.quote(node.value)
    if (peer, node.attr) in ctx.scope.inputs:
        help = f"an input is spelt `x.{peer}.{node.attr}`"
    elif isinstance(type, Pose):
        help = f"`position({ctx.quote(node.value)})` is a vector with `x`, `y` and `z`"
    elif isinstance(type, Opaque):
        help = "only operators look into it"
    end = span(node)[1]
    near = nearest(node.attr, known) if help.startswith("did you mean") else ()
    return ExprError(message, end - len(node.attr), end, help, "E0234").meant(node.attr, near)
