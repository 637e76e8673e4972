"""Typing rules of and, or, comparisons, `in` and `a if c else b`."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Literal

from specc.diagnostics.nearest import nearest
from specc.expr.alike import Side, infer_alike, needs_context, unlike
from specc.expr.context import Context
from specc.expr.errors import ExprError, ExprErrors, listed, one_of
from specc.expr.mismatch import fits, scalar_unit
from specc.expr.none import absence
from specc.expr.parse import span
from specc.model.expr import Among, Choice, Compare, Expr, Logic, Unary
from specc.model.types import Bool, Enum, Int, Pose, Real, Spatial, Text, Type, Vector

_OPERATORS: dict[type[ast.cmpop], Literal["<", "<=", ">", ">=", "==", "!="]] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}


def boolean(ctx: Context, node: ast.BoolOp, hint: Type | None) -> Expr:
    """`a and b and c`, `a or b`."""
    operands = tuple(ctx.truth(item) for item in node.values)
    op: Literal["and", "or"] = "and" if isinstance(node.op, ast.And) else "or"
    return Logic(op, operands, type=Bool(), span=span(node))


def comparison(ctx: Context, node: ast.Compare, hint: Type | None) -> Expr:
    """One comparison, or a chain `a < b <= c` as its comparisons joined by and."""
    if any(isinstance(op, (ast.In, ast.NotIn)) for op in node.ops):
        return _among(ctx, node)
    if any(isinstance(op, (ast.Is, ast.IsNot)) for op in node.ops):
        return absence(ctx, node)
    nodes = [node.left, *node.comparators]
    try:
        sides = list(zip(nodes, infer_alike(ctx, nodes), strict=True))
    except ExprErrors as found:
        raise ExprErrors([*found.errors, *_exact_besides(ctx, node.ops, nodes)]) from None
    links = ctx.each(
        *(partial(_link, ctx, sides[i], op, sides[i + 1]) for i, op in enumerate(node.ops))
    )
    return links[0] if len(links) == 1 else Logic("and", tuple(links), type=Bool(), span=span(node))


def _link(ctx: Context, left: Side, op: ast.cmpop, right: Side) -> Expr:
    sign, a, b = _OPERATORS[type(op)], left[1], right[1]
    if sign in ("==", "!="):
        _check_equality(ctx, left, right)
    elif scalar_unit(a.type) is None or scalar_unit(a.type) != scalar_unit(b.type):
        raise unlike(ctx, left, right, "have no order")
    return Compare(sign, a, b, type=Bool(), span=(span(left[0])[0], span(right[0])[1]))


def _check_equality(ctx: Context, left: Side, right: Side) -> None:
    a, b = left[1].type, right[1].type
    if a == b and _is_discrete(a):
        return
    if not _is_inexact(a) or not (a == b or fits(b, a)):
        raise unlike(ctx, left, right, "cannot be equal")
    # What is meant is clear, so that the rest can be judged.
    ctx.errors.append(_exact(ctx, left[0], right[0], a))


def _exact(ctx: Context, left: ast.expr, right: ast.expr, type: Type) -> ExprError:
    """The error of values of a type that are asked to be exactly equal."""
    tolerance = "tolerance, rotation_tolerance" if isinstance(type, Pose) else "tolerance"
    help = f"write `near({ctx.quote(left)}, {ctx.quote(right)}, {tolerance})`"
    if isinstance(type, Spatial):
        help = "compare the components one by one: `near(a.z, b.z, tolerance)`"
    message = f"values of type `{type}` are not compared exactly"
    return ExprError(message, span(left)[0], span(right)[1], help, "E0319")


def _exact_besides(
    ctx: Context, ops: Sequence[ast.cmpop], nodes: Sequence[ast.expr]
) -> Iterator[ExprError]:
    """What is asked to be exactly equal beside a side of unknown type, whatever that is."""
    for left, op, right in zip(nodes, ops, nodes[1:], strict=False):
        if isinstance(op, (ast.Eq, ast.NotEq)):
            types = [type for node in (left, right) if (type := _type_of(ctx, node))]
            if len(types) == 1 and _is_inexact(types[0]):
                yield _exact(ctx, left, right, types[0])


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
    if isinstance(type, Vector):
        return isinstance(type.element, Real)
    return isinstance(type, (Real, Pose, Spatial))


def _is_discrete(type: Type) -> bool:
    if isinstance(type, Vector):
        return not isinstance(type.element, Real)
    return isinstance(type, (Bool, Int, Enum, Text))


def _among(ctx: Context, node: ast.Compare) -> Expr:
    left, op, right = node.left, node.ops[0], node.comparators[0]
    if len(node.ops) > 1:
        raise ctx.error(node, "`in` stands in no chain", "join conditions with `and`", "E0302")
    if not isinstance(right, ast.Set):
        message = f"`{ctx.quote(right)}` is no set of members"
        raise ctx.error(right, message, "write it in braces: `v in {u, c}`", "E0313")
    item = ctx.infer(left)
    if not isinstance(item.type, Enum):
        message = f"`{ctx.quote(left)}` is `{item.type}`; `in` asks for members of an enum"
        raise ctx.error(left, message, code="E0313").because(ctx.origins(item))
    names = frozenset(_member_name(ctx, member, item.type) for member in right.elts)
    among = Among(item, names, type=Bool(), span=span(node))
    if isinstance(op, ast.In):
        return among
    return Unary("not", among, type=Bool(), span=span(node))


def _member_name(ctx: Context, node: ast.expr, enum: Enum) -> str:
    if isinstance(node, ast.Name) and node.id in enum.members:
        return node.id
    close = nearest(ctx.quote(node), enum.members)
    help = f"did you mean {one_of(close)}?" if close else f"members are {listed(enum.members)}"
    name = ctx.quote(node)
    error = ctx.error(node, f"`{name}` is no member of `{enum}`", help, "E0320").meant(name, close)
    if isinstance(node, ast.Name):
        message = f"member `{name}` of `{enum}` is not there yet"
        raise error.not_there(message, "add it to the type", name, close)
    raise error


def choice(ctx: Context, node: ast.IfExp, hint: Type | None) -> Expr:
    """`then if test else otherwise`; the branches are of one type."""
    branches = [node.body, node.orelse]
    (test,), (then, otherwise) = ctx.each(
        lambda: [ctx.truth(node.test)], lambda: _branches(ctx, branches, hint)
    )
    if fits(otherwise.type, then.type):
        return Choice(test, then, otherwise, type=then.type, span=span(node))
    if fits(then.type, otherwise.type):
        return Choice(test, then, otherwise, type=otherwise.type, span=span(node))
    if hint is not None and fits(then.type, hint):
        ctx.expect(node.orelse, hint)
    if hint is not None and fits(otherwise.type, hint):
        ctx.expect(node.body, hint)
    raise unlike(ctx, (node.body, then), (node.orelse, otherwise), "are of two types")


def _branches(ctx: Context, nodes: list[ast.expr], hint: Type | None) -> list[Expr]:
    """Branches of a choice may be None where nothing but a value of theirs is asked for."""
    return infer_alike(ctx, nodes, hint, optional=hint is None)


def unexpected_set(ctx: Context, node: ast.Set, hint: Type | None) -> Expr:
    """Braces stand behind `in` only."""
    raise ctx.error(node, "a set stands behind `in` only", "a vector has square brackets", "E0302")
