"""Types that have to be the same on both sides; what is used where."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from functools import partial

from specc.lang.context import Context
from specc.lang.errors import ExprError, Scope, one_of
from specc.lang.mismatch import scalar_unit
from specc.lang.parse import span
from specc.model.expr import Builtin, Expr, Number, TextLiteral
from specc.model.types import Enum, OptionalOf, PartialOf, Pose, Real, Spatial, Type

# How many arguments a function of the language takes, and the node that a call becomes.


def take(ctx: Context, node: ast.Call, usage: str, least: int, most: int | None = -1) -> None:
    """Refuse a call with another number of arguments; `most` None is any number."""
    given = len(node.args)
    upper = least if most == -1 else most
    if given >= least and (upper is None or given <= upper):
        return
    name = usage.partition("(")[0]
    wanted = f"{least} or more" if upper is None else f"{least} or {upper}"
    wanted = str(least) if upper == least else wanted
    noun = "argument" if wanted == "1" else "arguments"
    message = f"{name} takes {wanted} {noun}, not {given}"
    raise ctx.error(node, message, f"it is called as {usage}", "E0314")


def built(node: ast.Call, type: Type, *args: Expr) -> Builtin:
    """A call of a function of the language."""
    assert isinstance(node.func, ast.Name)  # it was looked up by its name
    return Builtin(node.func.id, args, type=type, span=span(node))


# Expressions that share a type: a literal takes it from a side that has one of its own.


Side = tuple[ast.expr, Expr]
"""An expression as it is written and as it is typed."""

_FRAMELESS = frozenset({"identity", "pose", "translation"})


def infer_alike(
    ctx: Context, nodes: Sequence[ast.expr], hint: Type | None = None, *, optional: bool = False
) -> list[Expr]:
    """The typed expressions. Those without a type of their own take that of the nearest other.

    They have to have a value unless they may be `optional`.
    """
    infer = ctx.infer_any if optional else ctx.infer
    typed = [i for i, node in enumerate(nodes) if not needs_context(node, ctx.scope)]
    if not typed:
        return ctx.each(*(partial(infer, node, hint) for node in nodes))
    own = ctx.each(*(partial(infer, nodes[i], hint) for i in typed))
    found = dict(zip(typed, own, strict=True))
    _choose_members(ctx, nodes, found)

    allowed = hint.value if isinstance(hint, OptionalOf) else hint

    def nearest_type(place: int) -> Type:
        if isinstance(allowed, PartialOf):
            return allowed
        return found[min(typed, key=lambda i: abs(i - place))].type

    rest = [i for i in range(len(nodes)) if i not in found]
    jobs = [partial(ctx.infer, nodes[i], nearest_type(i)) for i in rest]
    found |= zip(rest, ctx.each(*jobs), strict=True)
    return [found[i] for i in range(len(nodes))]


def _choose_members(ctx: Context, nodes: Sequence[ast.expr], found: dict[int, Expr]) -> None:
    """A name that is a value and a member too is the member beside a value of that enum."""
    for place in found:
        node = nodes[place]
        if not isinstance(node, ast.Name) or node.id not in ctx.scope.enums:
            continue
        beside = [expr.type for other, expr in found.items() if other != place]
        enums = [t for t in beside if isinstance(t, Enum) and node.id in t.members]
        if enums:
            found[place] = ctx.infer(node, enums[0])


def needs_context(node: ast.expr, scope: Scope) -> bool:
    """Whether the type of an expression depends on where it stands."""
    match node:
        case ast.Constant(value=value):
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            return value is None or is_number
        case ast.Name(id=name):
            return name == "_" or (name in scope.enums and scope.value(name) is None)
        case ast.List():
            return True
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return needs_context(operand, scope)
        case ast.IfExp(body=body, orelse=orelse):
            return needs_context(body, scope) and needs_context(orelse, scope)
        case ast.BinOp(op=ast.Add() | ast.Sub(), left=left, right=right):
            return needs_context(left, scope) and needs_context(right, scope)
        case ast.Call(func=ast.Name(id=name)):
            return name in _FRAMELESS
    return False


def unlike(ctx: Context, left: Side, right: Side, verdict: str) -> ExprError:
    """The error of two expressions that are not of one kind."""
    sides = [f"`{ctx.quote(node)}` is `{expr.type}`" for node, expr in (left, right)]
    a, b = left[1].type, right[1].type
    help, code = "", "E0313"
    if scalar_unit(a) is not None and scalar_unit(b) is not None:
        code = "E0311"
        help = _unit_help(ctx, left, b) or _unit_help(ctx, right, a)
    elif isinstance(a, (Spatial, Pose)) and type(a) is type(b):
        code, help = "E0312", "express both in the same frames first"
    else:
        help = _member_help(left[1], b) or _member_help(right[1], a)
    start, end = span(left[0])[0], span(right[0])[1]
    error = ExprError(f"{sides[0]} and {sides[1]}: they {verdict}", start, end, help, code)
    return error.because(ctx.origins(left[1], right[1]))


def _member_help(side: Expr, other: Type) -> str:
    if isinstance(side, TextLiteral) and isinstance(other, Enum):
        return f"members are written without quotes: {one_of(other.members)}"
    return ""


def _unit_help(ctx: Context, side: Side, other: Type) -> str:
    plain = Real().unit
    if isinstance(side[1], Number) and scalar_unit(side[1].type) == plain != scalar_unit(other):
        return f"a number carries its unit: `{ctx.quote(side[0])}[{scalar_unit(other)}]`"
    return ""
