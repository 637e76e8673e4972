"""Typing rules of operators: arithmetic, comparisons, `and`, `or`, `in` and choices."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Literal

from specc.diagnostics.nearest import nearest
from specc.lang.context import (
    UNNAMED,
    Context,
    Side,
    fits,
    infer_same_type,
    is_none,
    mismatch,
    needs_context,
    scalar_unit,
)
from specc.lang.errors import ExprError, ExprErrors, collect, did_you_mean, quoted
from specc.lang.parse import span
from specc.model import expr as m
from specc.model.expr import Expr
from specc.model.types import (
    Bool,
    Enum,
    Frame,
    Int,
    ListOf,
    OptionalOf,
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
    """Type an operator between two expressions."""
    match node.op:
        case ast.Add() | ast.Sub():
            return _sum(ctx, node, "+" if isinstance(node.op, ast.Add) else "-", hint)
        case ast.Mult() | ast.Div():
            return _product(ctx, node, "*" if isinstance(node.op, ast.Mult) else "/", hint)
        case ast.Pow():
            return _power(ctx, node)
    return _composition(ctx, node, hint)


def unary(ctx: Context, node: ast.UnaryOp, hint: Type | None) -> Expr:
    """Type `not a` or `-a`; a negative number becomes one literal."""
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
    match left.type, right.type:
        case ListOf(element=element), ListOf() as other if op == "+" and element == other.element:
            nonempty = left.type.nonempty or other.nonempty
            joined = ListOf(element, nonempty=nonempty)
            return m.Builtin(m.JOINED, (left, right), type=joined, span=span(node))
    left, right = _as_displacement(left, right), _as_displacement(right, left)
    type = _sum_type(left.type, right.type, op)
    if type is not None:
        return m.Binary(op, left, right, type=type, span=span(node))
    raise mismatch(ctx, (node.left, left), (node.right, right), _SUMS[op])


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


def _product(ctx: Context, node: ast.BinOp, op: Literal["*", "/"], hint: Type | None) -> Expr:
    pose = hint if isinstance(hint, Pose) else None  # no product is one, which has to be said
    left, right = collect(lambda: ctx.infer(node.left, pose), lambda: ctx.infer(node.right, pose))
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
    """Both sides. Poses made of numbers get their frames from those beside them and from the hint.

    The frame between two such poses has no name.
    """
    if isinstance(node.right, ast.List):
        left = ctx.infer(node.left)
        inside = point(left.type.child) if isinstance(left.type, Pose) else None
        return left, ctx.infer(node.right, inside)
    parent, child = _outer_frames(hint)
    is_left_open, is_right_open = (
        needs_context(factor, ctx.scope)
        for factor in (_factors(node.left)[-1], _factors(node.right)[0])
    )
    if is_left_open and not is_right_open:
        right = _factor(ctx, node.right, "", child)
        return _factor(ctx, node.left, parent, _outer_frames(right.type)[0]), right
    if is_right_open and not is_left_open:
        left = _factor(ctx, node.left, parent, "")
        return left, _factor(ctx, node.right, _outer_frames(left.type)[1], child)
    between = UNNAMED if is_left_open else ""
    left, right = collect(
        lambda: _factor(ctx, node.left, parent, between),
        lambda: _factor(ctx, node.right, between, child),
    )
    return left, right


def _outer_frames(type: Type | None) -> tuple[Frame, Frame]:
    """The first and the last frame of a pose; a point has the first. "" if it is not known."""
    match type:
        case Pose(parent=parent, child=child):
            return parent, child
        case Vector(frame=frame):
            return frame, ""
    return "", ""


def _factor(ctx: Context, node: ast.expr, parent: Frame, child: Frame) -> Expr:
    """One side of `@`, between frames of which one or both may be known."""
    is_open = any(needs_context(factor, ctx.scope) for factor in _factors(node))
    return ctx.infer(node, Pose(parent, child) if is_open and (parent or child) else None)


def _factors(node: ast.expr) -> list[ast.expr]:
    """The poses that are composed, from left to right."""
    match node:
        case ast.BinOp(left=left, op=ast.MatMult(), right=right):
            return [*_factors(left), *_factors(right)]
    return [node]


def _frame_help(ctx: Context, node: ast.BinOp, left: Pose, right: Pose) -> str:
    a, b = ctx.quote(node.left), ctx.quote(node.right)
    if left.child == right.child:
        return f"frame `{left.child}` matches in `{a} @ inverse({b})`"
    if left.parent == right.parent:
        return f"frame `{left.parent}` matches in `inverse({a}) @ {b}`"
    return ""


# Typing rule of `value is None` and `value is not None`.


def none_test(ctx: Context, node: ast.Compare) -> Expr:
    """Type `a is None` and `a is not None`."""
    op, right = node.ops[0], node.comparators[0]
    if len(node.ops) > 1 or not is_none(right):
        sign = "==" if isinstance(op, ast.Is) else "!="
        raise ctx.error(
            node, "`is` and `is not` can only test for None", f"write `{sign}`", "E0302"
        )
    value = ctx.infer_any(node.left)
    if not isinstance(value.type, OptionalOf):
        message = f"`{ctx.quote(node.left)}` is `{value.type}`, which is never None"
        help = f"leave the test out, or declare it as `optional[{value.type}]`"
        if isinstance(value, m.Input):
            help = f"test whether it has arrived: `present({ctx.quote(node.left)})`"
        raise ctx.error(node, message, help, "E0313").with_origins(ctx.origins(value))
    test = m.IsNone(value, type=Bool(), span=span(node))
    return test if isinstance(op, ast.Is) else m.Unary("not", test, type=Bool(), span=span(node))


# Typing rules of and, or, comparisons, `in` and `a if c else b`.


_OPERATORS: dict[type[ast.cmpop], Literal["<", "<=", ">", ">=", "==", "!="]] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}


def boolean(ctx: Context, node: ast.BoolOp, hint: Type | None) -> Expr:
    """Type `a and b and c` or `a or b`."""
    operands = tuple(ctx.truth(item) for item in node.values)
    op: Literal["and", "or"] = "and" if isinstance(node.op, ast.And) else "or"
    return m.Logic(op, operands, type=Bool(), span=span(node))


def comparison(ctx: Context, node: ast.Compare, hint: Type | None) -> Expr:
    """Type a comparison; a chain `a < b <= c` becomes comparisons joined by `and`."""
    if any(isinstance(op, (ast.In, ast.NotIn)) for op in node.ops):
        return _membership(ctx, node)
    if any(isinstance(op, (ast.Is, ast.IsNot)) for op in node.ops):
        return none_test(ctx, node)
    nodes = [node.left, *node.comparators]
    try:
        sides = list(zip(nodes, infer_same_type(ctx, nodes), strict=True))
    except ExprErrors as found:
        raise ExprErrors([*found.errors, *_more_exact_errors(ctx, node.ops, nodes)]) from None
    links = collect(
        *(partial(_compare_pair, ctx, sides[i], op, sides[i + 1]) for i, op in enumerate(node.ops))
    )
    return (
        links[0] if len(links) == 1 else m.Logic("and", tuple(links), type=Bool(), span=span(node))
    )


def _compare_pair(ctx: Context, left: Side, op: ast.cmpop, right: Side) -> Expr:
    sign, a, b = _OPERATORS[type(op)], left[1], right[1]
    if sign in ("==", "!="):
        _check_equality(ctx, left, right)
    elif scalar_unit(a.type) is None or scalar_unit(a.type) != scalar_unit(b.type):
        raise mismatch(ctx, left, right, "have no order")
    return m.Compare(sign, a, b, type=Bool(), span=(span(left[0])[0], span(right[0])[1]))


def _check_equality(ctx: Context, left: Side, right: Side) -> None:
    a, b = left[1].type, right[1].type
    if a == b and a.is_discrete:
        return
    if not _is_inexact(a) or not (a == b or fits(b, a)):
        raise mismatch(ctx, left, right, "cannot be equal")
    # What is meant is clear, so that the rest can be judged.
    ctx.errors.append(_exact_error(ctx, left[0], right[0], a))


def _exact_error(ctx: Context, left: ast.expr, right: ast.expr, type: Type) -> ExprError:
    """The error of comparing values of this type exactly."""
    tolerance = "tolerance, rotation_tolerance" if isinstance(type, Pose) else "tolerance"
    help = f"write `near({ctx.quote(left)}, {ctx.quote(right)}, {tolerance})`"
    if isinstance(type, Spatial):
        help = "compare the components one by one: `near(a.z, b.z, tolerance)`"
    message = f"values of type `{type}` are not compared exactly"
    return ExprError(message, span(left)[0], span(right)[1], help, "E0319")


def _more_exact_errors(
    ctx: Context, ops: Sequence[ast.cmpop], nodes: Sequence[ast.expr]
) -> Iterator[ExprError]:
    """The error of an exact comparison with a side of unknown type."""
    for left, op, right in zip(nodes, ops, nodes[1:], strict=False):
        if isinstance(op, (ast.Eq, ast.NotEq)):
            types = [type for node in (left, right) if (type := _type_of(ctx, node))]
            if len(types) == 1 and _is_inexact(types[0]):
                yield _exact_error(ctx, left, right, types[0])


def _type_of(ctx: Context, node: ast.expr) -> Type | None:
    """The type of an expression of its own; None if it has none, or only after more of the like."""
    if needs_context(node, ctx.scope) or any(isinstance(n, ast.Compare) for n in ast.walk(node)):
        return None
    before = len(ctx.errors)
    try:
        return ctx.infer(node).type
    except ExprErrors:
        return None
    finally:
        del ctx.errors[before:]


def _is_inexact(type: Type) -> bool:
    return isinstance(type, Real) or type.is_array


def _membership(ctx: Context, node: ast.Compare) -> Expr:
    left, op, right = node.left, node.ops[0], node.comparators[0]
    if len(node.ops) > 1:
        raise ctx.error(
            node,
            "`in` cannot stand in a chain of comparisons",
            "join conditions with `and`",
            "E0302",
        )
    if not isinstance(right, ast.Set):
        message = f"`{ctx.quote(right)}` is not a set of members"
        raise ctx.error(right, message, "write it in braces: `v in {u, c}`", "E0313")
    item = ctx.infer(left)
    if not isinstance(item.type, Enum):
        message = f"`{ctx.quote(left)}` is `{item.type}`; `in` tests for members of an enum"
        raise ctx.error(left, message, code="E0313").with_origins(ctx.origins(item))
    names = frozenset(_member_name(ctx, member, item.type) for member in right.elts)
    among = m.IsOneOf(item, names, type=Bool(), span=span(node))
    if isinstance(op, ast.In):
        return among
    return m.Unary("not", among, type=Bool(), span=span(node))


def _member_name(ctx: Context, node: ast.expr, enum: Enum) -> str:
    if isinstance(node, ast.Name) and node.id in enum.members:
        return node.id
    name = ctx.quote(node)
    close = nearest(name, enum.members)
    help = did_you_mean(close) or f"members are {quoted(enum.members)}"
    error = ctx.error(node, f"`{name}` is not a member of `{enum}`", help, "E0201")
    error.set_repair(name, close)
    if isinstance(node, ast.Name):
        message = f"member `{name}` of `{enum}` is not there yet"
        raise error.or_open_point(message, "add it to the type", name, close)
    raise error


def choice(ctx: Context, node: ast.IfExp, hint: Type | None) -> Expr:
    """Type `then if test else otherwise`, whose branches have one type."""
    branches = [node.body, node.orelse]
    (test,), (then, otherwise) = collect(
        lambda: [ctx.truth(node.test)],
        lambda: infer_same_type(ctx, branches, hint, optional=hint is None),
    )
    if fits(otherwise.type, then.type):
        return m.Choice(test, then, otherwise, type=then.type, span=span(node))
    if fits(then.type, otherwise.type):
        return m.Choice(test, then, otherwise, type=otherwise.type, span=span(node))
    if hint is not None and fits(then.type, hint):
        ctx.expect(node.orelse, hint)
    if hint is not None and fits(otherwise.type, hint):
        ctx.expect(node.body, hint)
    raise mismatch(ctx, (node.body, then), (node.orelse, otherwise), "are of two types")


def unexpected_set(ctx: Context, node: ast.Set, hint: Type | None) -> Expr:
    """Refuse a set, which can stand only after `in`."""
    raise ctx.error(
        node, "a set can stand only after `in`", "a vector has square brackets", "E0302"
    )
