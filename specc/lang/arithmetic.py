"""Typing rules of arithmetic, + - * / ** and @: units multiply, frames must meet."""

from __future__ import annotations

import ast
from dataclasses import replace
from typing import Literal

from specc.lang.context import Context, infer_same_type, mismatch, needs_context
from specc.lang.errors import collect
from specc.lang.mismatch import scalar_unit
from specc.lang.parse import span
from specc.model import expr as m
from specc.model.expr import Expr
from specc.model.types import (
    Bool,
    Int,
    ListOf,
    Pose,
    Real,
    Spatial,
    Type,
    Vector,
    point,
)

_LARGEST_POWER = 9
_SUMS = {"+": "cannot be added", "-": "cannot be subtracted"}


def binary(ctx: Context, node: ast.BinOp, hint: Type | None) -> Expr:
    """An operator between two expressions."""
    match node.op:
        case ast.Add() | ast.Sub():
            return _sum(ctx, node, "+" if isinstance(node.op, ast.Add) else "-", hint)
        case ast.Mult() | ast.Div():
            return _product(ctx, node, "*" if isinstance(node.op, ast.Mult) else "/")
        case ast.Pow():
            return _power(ctx, node)
    return _composition(ctx, node, hint)


def unary(ctx: Context, node: ast.UnaryOp, hint: Type | None) -> Expr:
    """`not a`, `-a`; a negative number is one literal."""
    if isinstance(node.op, ast.Not):
        return m.Unary("not", ctx.truth(node.operand), type=Bool(), span=span(node))
    operand = ctx.infer(node.operand, hint)
    if isinstance(operand, m.Number):
        return m.Number(-operand.value, type=operand.type, span=span(node))
    if _is_quantity(operand.type):
        return m.Unary("-", operand, type=_frameless(operand.type), span=span(node))
    message = f"`{ctx.quote(node.operand)}` is `{operand.type}`, which cannot be negated"
    raise ctx.error(node, message, code="E0313").with_origins(ctx.origins(operand))


def _is_quantity(type: Type) -> bool:
    return isinstance(type, Int) or bool(type.units)


def _sum(ctx: Context, node: ast.BinOp, op: Literal["+", "-"], hint: Type | None) -> Expr:
    left, right = infer_same_type(ctx, [node.left, node.right], hint)
    a, b = scalar_unit(left.type), scalar_unit(right.type)
    if a is not None and a == b:
        whole = isinstance(left.type, Int) and isinstance(right.type, Int)
        return m.Binary(op, left, right, type=Int() if whole else Real(a), span=span(node))
    list_type = _concatenation(left.type, right.type) if op == "+" else None
    if list_type is not None:
        return m.Builtin(m.JOINED, (left, right), type=list_type, span=span(node))
    left, right = _as_displacement(left, right), _as_displacement(right, left)
    type = _sum_type(left.type, right.type, op)
    if type is not None:
        return m.Binary(op, left, right, type=type, span=span(node))
    raise mismatch(ctx, (node.left, left), (node.right, right), _SUMS[op])


def _concatenation(a: Type, b: Type) -> ListOf | None:
    """The type of the items of two lists of one kind."""
    if isinstance(a, ListOf) and isinstance(b, ListOf) and a.element == b.element:
        return ListOf(a.element, nonempty=a.nonempty or b.nonempty)
    return None


def _as_displacement(expr: Expr, other: Expr) -> Expr:
    """A literal beside a point is how far it is moved."""
    if not isinstance(expr, m.Items) or isinstance(other, m.Items):
        return expr
    return replace(expr, type=_frameless(expr.type))


def _frameless(type: Type) -> Type:
    """The type of a vector that is no longer a point."""
    return replace(type, frame="") if isinstance(type, Vector) else type


def _sum_type(a: Type, b: Type, op: Literal["+", "-"]) -> Type | None:
    """A point that is moved is a point, the difference of two in one frame is a vector."""
    if not isinstance(a, Vector) or not isinstance(b, Vector) or not (a.frame or b.frame):
        return a if a == b and _is_quantity(a) else None
    if a.frame and b.frame:
        return _frameless(a) if a == b and op == "-" else None
    if _frameless(a) != _frameless(b) or (b.frame and op == "-"):
        return None
    return a if a.frame else b


def _product(ctx: Context, node: ast.BinOp, op: Literal["*", "/"]) -> Expr:
    left, right = collect(lambda: ctx.infer(node.left), lambda: ctx.infer(node.right))
    type = _product_type(left.type, right.type, op)
    if type is None and op == "*":
        type = _product_type(right.type, left.type, op)
    if type is None:
        a, b = ctx.quote(node.left), ctx.quote(node.right)
        sides = f"`{a}` is `{left.type}` and `{b}` is `{right.type}`"
        help = "poses are composed with `@`" if isinstance(left.type, Pose) else ""
        verb = "multiplied" if op == "*" else "divided"
        error = ctx.error(node, f"{sides}: they cannot be {verb}", help, "E0313")
        raise error.with_origins(ctx.origins(left, right))
    return m.Binary(op, left, right, type=_reasonable(ctx, node, type), span=span(node))


def _product_type(type: Type, by: Type, op: Literal["*", "/"]) -> Type | None:
    """Type of `type * by` or `type / by` where `by` is a number; None if there is none."""
    factor = scalar_unit(by)
    if factor is None:
        return None
    if op == "/":
        factor = factor**-1
    match type:
        case Int() if isinstance(by, Int) and op == "*":
            return Int()
        case Int():
            return Real(factor)
        case Real():
            return Real(type.unit * factor)
        case Spatial():
            return Spatial(type.frame, type.linear * factor, type.angular * factor)
        case Vector(size=size, element=Real(unit=unit)):
            return Vector(size, Real(unit * factor))
    return None


def _reasonable(ctx: Context, node: ast.BinOp, type: Type) -> Type:
    if any(not unit.is_reasonable for unit in type.units):
        message, help = (
            "the powers in the unit of this are too large",
            "compute it in an operator",
        )
        raise ctx.error(node, message, help, "E0311")
    return type


def _power(ctx: Context, node: ast.BinOp) -> Expr:
    base, exponent = collect(lambda: ctx.infer(node.left), lambda: ctx.infer(node.right))
    power = int(exponent.value) if isinstance(exponent, m.Number) else _LARGEST_POWER + 1
    if not isinstance(exponent.type, Int) or abs(power) > _LARGEST_POWER:
        message = (
            f"`{ctx.quote(node.right)}` is not an exponent: an exponent is a whole number up to 9"
        )
        raise ctx.error(node.right, message, "the square root is `sqrt(a)`", "E0313")
    unit = scalar_unit(base.type)
    if unit is None:
        message = f"`{ctx.quote(node.left)}` is `{base.type}`, which cannot be raised to a power"
        raise ctx.error(node, message, code="E0313").with_origins(ctx.origins(base))
    type = Int() if isinstance(base.type, Int) and power >= 0 else Real(unit**power)
    return m.Binary("**", base, exponent, type=_reasonable(ctx, node, type), span=span(node))


def _composition(ctx: Context, node: ast.BinOp, hint: Type | None) -> Expr:
    left, right = _infer_operands(ctx, node, hint)
    if isinstance(left.type, Pose) and isinstance(right.type, Vector) and right.type.frame:
        return _moved_point(ctx, node, left, right)
    if not isinstance(left.type, Pose) or not isinstance(right.type, Pose):
        side, expr = (node.right, right) if isinstance(left.type, Pose) else (node.left, left)
        message = f"`{ctx.quote(side)}` is `{expr.type}`; `@` composes poses and moves points"
        error = ctx.error(side, message, "numbers are multiplied with `*`", "E0313")
        raise error.with_origins(ctx.origins(expr))
    if left.type.child == right.type.parent:
        type = Pose(left.type.parent, right.type.child)
        return m.Binary("@", left, right, type=type, span=span(node))
    frames = f"frames `{left.type.child}` and `{right.type.parent}` differ"
    message = f"`{left.type} @ {right.type}`: {frames}"
    error = ctx.error(node, message, _frame_help(ctx, node, left.type, right.type), "E0312")
    raise error.with_origins(ctx.origins(left, right))


def _moved_point(ctx: Context, node: ast.BinOp, X: Expr, p: Expr) -> Expr:
    """A point in the parent's frame of a pose, by that in the child's."""
    assert isinstance(X.type, Pose)  # the caller looked
    assert isinstance(p.type, Vector)  # the same
    if p.type.frame == X.type.child:
        return m.Binary("@", X, p, type=point(X.type.parent), span=span(node))
    frames = f"frames `{X.type.child}` and `{p.type.frame}` differ"
    inverted = (
        f"`inverse({ctx.quote(node.left)}) @ {ctx.quote(node.right)}` is `{point(X.type.child)}`"
    )
    help = inverted if p.type.frame == X.type.parent else ""
    error = ctx.error(node, f"`{X.type} @ {p.type}`: {frames}", help, "E0312")
    raise error.with_origins(ctx.origins(X, p))


def _infer_operands(ctx: Context, node: ast.BinOp, hint: Type | None) -> tuple[Expr, Expr]:
    """Both sides; a pose without frames of its own gets them from the other and from the hint."""
    if isinstance(node.right, ast.List):
        left = ctx.infer(node.left)
        inside = point(left.type.child) if isinstance(left.type, Pose) else None
        return left, ctx.infer(node.right, inside)
    if isinstance(hint, Pose) and needs_context(node.right, ctx.scope):
        left = ctx.infer(node.left)
        inner = Pose(left.type.child, hint.child) if isinstance(left.type, Pose) else None
        return left, ctx.infer(node.right, inner)
    if isinstance(hint, Pose) and needs_context(node.left, ctx.scope):
        right = ctx.infer(node.right)
        inner = Pose(hint.parent, right.type.parent) if isinstance(right.type, Pose) else None
        return ctx.infer(node.left, inner), right
    left, right = collect(lambda: ctx.infer(node.left), lambda: ctx.infer(node.right))
    return left, right


def _frame_help(ctx: Context, node: ast.BinOp, left: Pose, right: Pose) -> str:
    a, b = ctx.quote(node.left), ctx.quote(node.right)
    if left.child == right.child:
        return f"frame `{left.child}` matches in `{a} @ inverse({b})`"
    if left.parent == right.parent:
        return f"frame `{left.parent}` matches in `inverse({a}) @ {b}`"
    return ""
