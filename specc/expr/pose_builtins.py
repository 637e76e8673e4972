"""Typing rules of the functions that make and take poses apart."""

from __future__ import annotations

import ast

from specc.expr.alike import unlike
from specc.expr.context import Context
from specc.expr.errors import ExprError
from specc.expr.parse import span
from specc.expr.usage import built, take
from specc.model.expr import Expr
from specc.model.types import Bool, Pose, Real, Type, Vector
from specc.model.units import METRE, RADIAN

_TOLERANCES = "near(X, Y, position_tolerance, rotation_tolerance)"


def near_poses(ctx: Context, node: ast.Call, a: Expr, b: Expr) -> Expr:
    """`near` of two poses in the same frames: a distance and an angle as tolerances."""
    if a.type != b.type:
        raise unlike(ctx, (node.args[0], a), (node.args[1], b), "cannot be near")
    take(ctx, node, _TOLERANCES, 4)
    position, rotation = ctx.each(
        lambda: ctx.expect(node.args[2], Real(METRE)),
        lambda: ctx.expect(node.args[3], Real(RADIAN)),
    )
    return built(node, Bool(), a, b, position, rotation)


def _inverse(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "inverse(X)", 1)
    inner = Pose(hint.child, hint.parent) if isinstance(hint, Pose) else None
    value = ctx.infer(node.args[0], inner)
    if isinstance(value.type, Pose):
        return built(node, Pose(value.type.child, value.type.parent), value)
    raise _no_pose(ctx, node, value)


def _position(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "position(X)", 1)
    value = ctx.infer(node.args[0])
    if isinstance(value.type, Pose):
        return built(node, Vector(3, Real(METRE)), value)
    raise _no_pose(ctx, node, value)


def _no_pose(ctx: Context, node: ast.Call, value: Expr) -> ExprError:
    message = (
        f"`{ctx.quote(node.args[0])}` is `{value.type}`; `{ctx.quote(node.func)}` takes a pose"
    )
    return ctx.error(node.args[0], message, code="E0315").because(ctx.origins(value))


def _identity(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "identity()", 0)
    return built(node, _frames(ctx, node, hint))


def _translation(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "translation(x, y, z)", 3)
    x, y, z = node.args
    parts = ctx.each(
        lambda: ctx.expect(x, Real(METRE)),
        lambda: ctx.expect(y, Real(METRE)),
        lambda: ctx.expect(z, Real(METRE)),
    )
    return built(node, _frames(ctx, node, hint), *parts)


def _pose(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """Position and unit quaternion (x, y, z, w); the evaluation normalises it."""
    take(ctx, node, "pose(position, quaternion_xyzw)", 2)
    parts = ctx.each(
        lambda: ctx.expect(node.args[0], Vector(3, Real(METRE))),
        lambda: ctx.expect(node.args[1], Vector(4, Real())),
    )
    return built(node, _frames(ctx, node, hint), *parts)


def _frames(ctx: Context, node: ast.Call, hint: Type | None) -> Pose:
    if isinstance(hint, Pose):
        return hint
    if hint is not None:
        message = f"`{ctx.quote(node)}` is a pose; expected `{hint}`"
        raise ExprError(message, *span(node))
    help = "declare it as memory of a pose type, whose frames it takes"
    message = f"the frames of `{ctx.quote(node)}` are not known here"
    raise ctx.error(node, message, help, "E0317")


POSE_BUILTINS = {
    "inverse": _inverse,
    "position": _position,
    "identity": _identity,
    "translation": _translation,
    "pose": _pose,
}
