"""Typing rules of plain names: values, files, members of enums, the clock."""

from __future__ import annotations

import ast
from typing import Literal, cast

from specc.diagnostics.nearest import nearest
from specc.expr.context import Context
from specc.expr.errors import ExprError, one_of
from specc.expr.parse import span
from specc.expr.scope import CLOCK_NAMES, Scope
from specc.model.expr import Bound, Clock, ConstantRef, Expr, FileRef, LetRef, Member, MemoryRef
from specc.model.types import Bool, Enum, File, Real, Type
from specc.model.units import SECOND, UNITS

_NODES: dict[str, type[Bound | MemoryRef | LetRef | ConstantRef]] = {
    "bound": Bound,
    "memory": MemoryRef,
    "lets": LetRef,
    "constants": ConstantRef,
}
_CLOCK: dict[str, Type] = {"elapsed": Real(SECOND), "entered": Bool(), "period": Real(SECOND)}
_FOREIGN = {"true": "True", "false": "False", "null": "", "None": "", "nan": "_", "NIL": "[]"}


def name(ctx: Context, node: ast.Name, hint: Type | None) -> Expr:
    """A plain name; the hint tells a member or a file from a value of the same name."""
    value = ctx.scope.value(node.id)
    if isinstance(hint, Enum) and node.id in hint.members:
        if value and value[1] == hint:
            message = f"`{node.id}` is both a value and a member of `{hint}`"
            raise ctx.error(node, message, "give the value another name", "E0231")
        return Member(node.id, type=hint, span=span(node))
    if node.id in ctx.scope.files and (value is None or isinstance(hint, File)):
        return FileRef(node.id, type=File(), span=span(node))
    if value:
        return _value(ctx, node, *value)
    if node.id in ctx.scope.enums:
        return _member(ctx, node)
    if node.id in CLOCK_NAMES and ctx.scope.allow_clock:
        which = cast(Literal["elapsed", "entered", "period"], node.id)
        return Clock(which, type=_CLOCK[which], span=span(node))
    raise _unknown(ctx, node, hint)


def _value(ctx: Context, node: ast.Name, kind: str, type: Type) -> Expr:
    if kind in ("memory", "lets") and not ctx.scope.allow_memory:
        raise _too_early(ctx, node)
    return _NODES[kind](node.id, type=type, span=span(node))


def _too_early(ctx: Context, node: ast.Name) -> ExprError:
    message = f"`{node.id}` has no value here: memory starts after this is evaluated"
    known = (
        "inputs, constants and operators" if ctx.scope.inputs else "constants and operators only"
    )
    return ctx.error(node, message, f"refer to {known}", "E0230")


def _member(ctx: Context, node: ast.Name) -> Expr:
    enums = ctx.scope.enums[node.id]
    if len(enums) > 1:
        message = f"`{node.id}` is a member of {one_of(enums).replace(' or ', ' and ')}"
        help = "which is meant is seen where one of them is expected; rename one where none is"
        raise ctx.error(node, message, help, "E0231")
    return Member(node.id, type=enums[0], span=span(node))


def _unknown(ctx: Context, node: ast.Name, hint: Type | None) -> ExprError:
    name, scope = node.id, ctx.scope
    if name == "_":
        help = "`_` is an item where `partial[...]` is expected: `[_, _, 0, _, _, _]`"
        return ctx.error(node, "`_` stands outside a vector", help, "E0318")
    if name == "x":
        return ctx.error(
            node, "`x` is all input buffers", "name one element, `x.peer.element`", "E0203"
        )
    if name == "y":
        return output_read(ctx, node)
    if name in CLOCK_NAMES:
        message = f"`{name}` has no value here: no state has been entered"
        return ctx.error(node, message, "refer to constants and operators only", "E0230")
    if name in scope.operators:
        parameters = ", ".join(p for p, _ in scope.operators[name].parameters)
        return ctx.error(
            node, f"`{name}` is an operator", f"call it: `{name}({parameters})`", "E0202"
        )
    if name in scope.later:
        raise _too_early(ctx, node)
    help = _unknown_help(ctx, name)
    near = nearest(name, scope.names()) if help.startswith("did you mean") else ()
    error = ctx.error(node, f"unknown name `{name}`", help, "E0201").meant(name, near)
    if help == f"write `{_FOREIGN.get(name)}`" and name in ("true", "false"):
        error.repair = _FOREIGN[name]
    if help and not near:
        return error
    way = _way_to_declare(scope, hint)
    if (scope.known_peers() or scope.allow_clock) and not isinstance(hint, File):
        peer = next(iter(scope.known_peers()), "peer")
        way += (
            f"; a signal from elsewhere is an element of a buffer, e.g. `x.{peer}.{name}`: declare "
            "it under `x:` here and under `y:` of what sends it"
        )
    return error.not_there(f"`{name}` is not there yet", way, name, near)


def _way_to_declare(scope: Scope, hint: Type | None) -> str:
    """Lets depend on memory, so that nothing names one where memory has no value yet."""
    lets = scope.allow_memory and (scope.allow_clock or scope.known_peers())
    match hint:
        case File():
            return "declare it under `files:`"
        case Enum(members=members):
            way = "declare it, e.g. under `let:`" if lets else "declare it under `constants:`"
            return f"{way}, or write {one_of(members)}"
    return f"declare it{', e.g. under `let:` or' if lets else ' under'} `constants:`"


def _unknown_help(ctx: Context, name: str) -> str:
    scope = ctx.scope
    inputs = [f"x.{peer}.{element}" for peer, element in scope.inputs if element == name]
    if inputs:
        return f"an input is spelt {one_of(inputs)}"
    if name in scope.known_peers():
        return f"an input is spelt `x.{name}.element`"
    close = nearest(name, scope.names())
    if close:
        return f"did you mean {one_of(close)}?"
    if name in _FOREIGN:
        return f"write `{_FOREIGN[name]}`" if _FOREIGN[name] else ""
    return f"a unit stands in brackets behind its number: `1[{name}]`" if name in UNITS else ""


def output_read(ctx: Context, node: ast.expr) -> ExprError:
    """The error of an expression that refers to an output buffer."""
    help = "keep the value in memory, or name it under `let:` and use it in both places"
    return ctx.error(node, f"`{ctx.quote(node)}` is an output: it cannot be read", help, "E0235")
