"""Typing rules of questions and choices: comparisons, `in`, `is None`, `and`, `or`, `if`."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Literal

from specc.diagnostics.nearest import nearest
from specc.lang.context import Context, Side, infer_same_type, is_none, mismatch, needs_context
from specc.lang.errors import ExprError, ExprErrors, collect, did_you_mean, quoted
from specc.lang.mismatch import fits, scalar_unit
from specc.lang.parse import span
from specc.model import expr as m
from specc.model.expr import Expr
from specc.model.types import (
    Bool,
    Enum,
    OptionalOf,
    Pose,
    Real,
    Spatial,
    Type,
)

# Typing rule of `value is None` and `value is not None`.


def none_test(ctx: Context, node: ast.Compare) -> Expr:
    """Whether an optional value is there."""
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
    """`a and b and c`, `a or b`."""
    operands = tuple(ctx.truth(item) for item in node.values)
    op: Literal["and", "or"] = "and" if isinstance(node.op, ast.And) else "or"
    return m.Logic(op, operands, type=Bool(), span=span(node))


def comparison(ctx: Context, node: ast.Compare, hint: Type | None) -> Expr:
    """One comparison, or a chain `a < b <= c` as its comparisons joined by and."""
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
    error = ctx.error(node, f"`{name}` is not a member of `{enum}`", help, "E0320")
    error.with_suggestions(name, close)
    if isinstance(node, ast.Name):
        message = f"member `{name}` of `{enum}` is not there yet"
        raise error.or_open_point(message, "add it to the type", name, close)
    raise error


def choice(ctx: Context, node: ast.IfExp, hint: Type | None) -> Expr:
    """`then if test else otherwise`; the branches are of one type."""
    branches = [node.body, node.orelse]
    (test,), (then, otherwise) = collect(
        lambda: [ctx.truth(node.test)], lambda: _branches(ctx, branches, hint)
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


def _branches(ctx: Context, nodes: list[ast.expr], hint: Type | None) -> list[Expr]:
    """Branches of a choice may be None where no particular type is required."""
    return infer_same_type(ctx, nodes, hint, optional=hint is None)


def unexpected_set(ctx: Context, node: ast.Set, hint: Type | None) -> Expr:
    """A set can stand only after `in`."""
    raise ctx.error(
        node, "a set can stand only after `in`", "a vector has square brackets", "E0302"
    )
