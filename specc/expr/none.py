"""Typing rule of `value is None` and `value is not None`."""

from __future__ import annotations

import ast

from specc.expr.absent import is_none
from specc.expr.context import Context
from specc.expr.parse import span
from specc.model.expr import Expr, Input, IsNone, Unary
from specc.model.types import Bool, OptionalOf


def absence(ctx: Context, node: ast.Compare) -> Expr:
    """Whether an optional value is there."""
    op, right = node.ops[0], node.comparators[0]
    if len(node.ops) > 1 or not is_none(right):
        sign = "==" if isinstance(op, ast.Is) else "!="
        raise ctx.error(node, "`is` and `is not` ask for None only", f"write `{sign}`", "E0302")
    value = ctx.infer_any(node.left)
    if not isinstance(value.type, OptionalOf):
        message = f"`{ctx.quote(node.left)}` is `{value.type}`, which is never None"
        help = f"leave the test out, or declare it as `optional[{value.type}]`"
        if isinstance(value, Input):
            help = f"ask whether it has arrived: `present({ctx.quote(node.left)})`"
        raise ctx.error(node, message, help, "E0313").because(ctx.origins(value))
    asked = IsNone(value, type=Bool(), span=span(node))
    return asked if isinstance(op, ast.Is) else Unary("not", asked, type=Bool(), span=span(node))
