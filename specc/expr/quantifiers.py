"""Typing rules of `all(... for v in ...)` and `any(... for v in ...)`."""

from __future__ import annotations

import ast
from typing import Literal

from specc.expr.absent import not_empty
from specc.expr.context import Context
from specc.expr.errors import ExprError
from specc.expr.mismatch import scalar_unit
from specc.expr.parse import span
from specc.expr.scope import RESERVED
from specc.model.expr import Expr, Quantifier
from specc.model.types import Bool, ListOf, Type, Vector

_USAGE = "all(v in {u, c} for v in x.c.b)"


def quantifier(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """A condition on every item, or on some item, of a vector or a list."""
    comprehension = _comprehension(ctx, node)
    variable = _variable(ctx, comprehension)
    over = ctx.infer(comprehension.iter)
    element = _element(ctx, comprehension.iter, over)
    generator = node.args[0]
    assert isinstance(generator, ast.GeneratorExp)  # _comprehension looked
    body = ctx.inside(ctx.scope.binding(variable, element)).truth(generator.elt)
    kind: Literal["all", "any"] = "all" if ctx.quote(node.func) == "all" else "any"
    return Quantifier(kind, variable, over, body, type=Bool(), span=span(node))


def extreme(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """The item of a list for which a number is largest or smallest; the list must have one."""
    comprehension = _comprehension(ctx, node)
    variable = _variable(ctx, comprehension)
    over = not_empty(ctx.infer(comprehension.iter))
    element = _element(ctx, comprehension.iter, over)
    generator = node.args[0]
    assert isinstance(generator, ast.GeneratorExp)  # _comprehension looked
    body = ctx.inside(ctx.scope.binding(variable, element)).infer(generator.elt)
    if scalar_unit(body.type) is None:
        message = f"`{ctx.quote(generator.elt)}` is `{body.type}`; items are compared by a number"
        raise ctx.error(generator.elt, message, code="E0315").because(ctx.origins(body))
    kind: Literal["argmax", "argmin"] = "argmax" if ctx.quote(node.func) == "argmax" else "argmin"
    return Quantifier(kind, variable, over, body, type=element, span=span(node))


def stray_generator(ctx: Context, node: ast.GeneratorExp, hint: Type | None) -> Expr:
    """`... for v in ...` stands in quantifiers only."""
    message = "`for` stands in `all(...)`, `any(...)`, `argmax(...)` and `argmin(...)` only"
    raise ctx.error(node, message, f"for example `{_USAGE}`", "E0302")


def _comprehension(ctx: Context, node: ast.Call) -> ast.comprehension:
    match node.args:
        case [ast.GeneratorExp(generators=[ast.comprehension(ifs=[], is_async=0) as only])]:
            return only
        case [ast.GeneratorExp(generators=[ast.comprehension(ifs=[filter, *_]), *_])]:
            help = "write it into the condition: `all(not a or b for ...)`, `any(a and b for ...)`"
            raise ctx.error(filter, "a quantifier has no filter", help, "E0302")
        case [ast.GeneratorExp()]:
            help = "put one quantifier into the other"
            raise ctx.error(node, "a quantifier goes over one vector or list", help, "E0302")
    name = ctx.quote(node.func)
    usage = _USAGE if name in ("all", "any") else f"{name}(abs(v) for v in [1, -2])"
    raise ctx.error(node, f"`{name}` goes over a vector or list", f"for example `{usage}`", "E0314")


def _variable(ctx: Context, comprehension: ast.comprehension) -> str:
    target = comprehension.target
    if not isinstance(target, ast.Name):
        raise ctx.error(target, "a quantifier has one variable", f"for example `{_USAGE}`", "E0302")
    scope = ctx.scope
    known = target.id in RESERVED or target.id in scope.files or target.id in scope.enums
    if known or scope.value(target.id):
        message = f"the variable `{target.id}` hides a name that is already in use"
        raise ctx.error(target, message, "choose another name for the variable", "E0232")
    return target.id


def _element(ctx: Context, node: ast.expr, over: Expr) -> Type:
    if isinstance(over.type, (Vector, ListOf)):
        return over.type.element
    message = f"`{ctx.quote(node)}` is `{over.type}`; a quantifier goes over a vector or a list"
    raise ExprError(message, *span(node), code="E0313").because(ctx.origins(over))
