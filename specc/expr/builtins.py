"""The functions of the language itself: how each is typed. Numbers, vectors and buffers here."""

from __future__ import annotations

import ast
from collections.abc import Callable
from fractions import Fraction

from specc.expr.alike import infer_alike, unlike
from specc.expr.context import Context
from specc.expr.mismatch import scalar_unit
from specc.expr.parse import span
from specc.expr.parts import input_element
from specc.expr.pose_builtins import POSE_BUILTINS, near_poses
from specc.expr.quantifiers import extreme, quantifier
from specc.expr.usage import built, take
from specc.model.expr import Expr, Fresh, Present
from specc.model.types import Bool, Int, ListOf, Pose, Real, Spatial, Type, Vector
from specc.model.units import DIMENSIONLESS

BuiltinRule = Callable[[Context, ast.Call, "Type | None"], Expr]


def _fresh(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "fresh(x.peer.element)", 1)
    return Fresh(input_element(ctx, node.args[0]), type=Bool(), span=span(node))


def _present(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "present(x.peer.element)", 1)
    return Present(input_element(ctx, node.args[0]), type=Bool(), span=span(node))


def _near(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """Numbers and vectors with one tolerance in their unit, poses with two."""
    take(ctx, node, "near(a, b, tolerance)", 3, 4)
    a, b = infer_alike(ctx, node.args[:2])
    if isinstance(a.type, Pose) or isinstance(b.type, Pose):
        return near_poses(ctx, node, a, b)
    unit = _common_unit(a.type, b.type)
    if isinstance(a.type, Spatial) and a.type == b.type:
        message = f"`{ctx.quote(node.args[0])}` is `{a.type}`, whose components differ in unit"
        raise ctx.error(
            node, message, "compare them one by one: `near(a.z, b.z, tolerance)`", "E0315"
        )
    if unit is None and a.type == b.type:
        message = f"`{ctx.quote(node.args[0])}` is `{a.type}`"
        reads = "`near` compares numbers, vectors of `real` and poses"
        raise ctx.error(node, f"{message}; {reads}", "compare with `==`", "E0315")
    if unit is None:
        raise unlike(ctx, (node.args[0], a), (node.args[1], b), "cannot be near")
    take(ctx, node, "near(a, b, tolerance)", 3)
    return built(node, Bool(), a, b, ctx.expect(node.args[2], unit))


def _common_unit(a: Type, b: Type) -> Real | None:
    """The type of the tolerance when two numbers or two vectors are compared."""
    if isinstance(a, Vector) and a == b:
        return a.element if isinstance(a.element, Real) else None
    unit = scalar_unit(a)
    return Real(unit) if unit is not None and unit == scalar_unit(b) else None


def _len(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "len(list)", 1)
    value = ctx.infer(node.args[0])
    if isinstance(value.type, ListOf):
        return built(node, Int(), value)
    help = f"its length is always {value.type.size}" if isinstance(value.type, Vector) else ""
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `len` counts the items of a list"
    raise ctx.error(node.args[0], message, help, "E0315").because(ctx.origins(value))


def _norm(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "norm(vector)", 1)
    value = ctx.infer(node.args[0])
    if isinstance(value.type, Vector) and isinstance(value.type.element, Real):
        return built(node, value.type.element, value)
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `norm` takes a vector of reals"
    raise ctx.error(node.args[0], message, code="E0315").because(ctx.origins(value))


def _abs(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "abs(a)", 1)
    value = ctx.infer(node.args[0])
    if scalar_unit(value.type) is not None:
        return built(node, value.type, value)
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `abs` takes a number"
    error = ctx.error(node.args[0], message, "the length of a vector is `norm(v)`", "E0315")
    raise error.because(ctx.origins(value))


def _sqrt(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "sqrt(a)", 1)
    value = ctx.infer(node.args[0], Real())
    unit = scalar_unit(value.type)
    if unit is not None:
        return built(node, Real(unit ** Fraction(1, 2)), value)
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `sqrt` takes a number"
    raise ctx.error(node.args[0], message, code="E0315").because(ctx.origins(value))


def _extreme(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """`min` and `max` of two or more numbers of one unit."""
    take(ctx, node, f"{ctx.quote(node.func)}(a, b)", 2, None)
    values = infer_alike(ctx, node.args, hint)
    unit = scalar_unit(values[0].type)
    for arg, value in zip(node.args, values, strict=True):
        if unit is None or scalar_unit(value.type) != unit:
            raise unlike(ctx, (node.args[0], values[0]), (arg, value), "have no order")
    whole = all(isinstance(value.type, Int) for value in values)
    return built(node, Int() if whole else Real(unit or DIMENSIONLESS), *values)


BUILTINS: dict[str, BuiltinRule] = {
    "all": quantifier,
    "any": quantifier,
    "argmax": extreme,
    "argmin": extreme,
    "fresh": _fresh,
    "present": _present,
    "near": _near,
    "len": _len,
    "norm": _norm,
    "abs": _abs,
    "sqrt": _sqrt,
    "min": _extreme,
    "max": _extreme,
    **POSE_BUILTINS,
}
"""Name -> typing rule."""
