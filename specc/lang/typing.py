"""Syntax to typed expressions: the rule for every kind of syntax, and the way in."""

from __future__ import annotations

import ast
from typing import Any

from specc.lang import arithmetic, calls, literals, logic, names
from specc.lang.context import Context
from specc.lang.errors import ExprErrors, Scope
from specc.lang.parse import parse
from specc.model.expr import Expr
from specc.model.types import Type

# A rule takes its own kind of node, which the key of the table guarantees.
_RULES: dict[type[ast.expr], Any] = {
    ast.Constant: literals.constant,
    ast.List: literals.items,
    ast.Name: names.name,
    ast.Attribute: names.attribute,
    ast.Subscript: names.subscript,
    ast.BinOp: arithmetic.binary,
    ast.UnaryOp: arithmetic.unary,
    ast.BoolOp: logic.boolean,
    ast.Compare: logic.comparison,
    ast.IfExp: logic.choice,
    ast.Set: logic.unexpected_set,
    ast.Call: calls.call,
    ast.GeneratorExp: logic.stray_generator,
}


def check(tree: ast.expr, text: str, scope: Scope, expected: Type | None = None) -> Expr:
    """The typed expression of a tree that `parse` made of `text`.

    Raises:
        ExprErrors: everything that is wrong; an error has no follow-up errors.
    """
    ctx = Context(scope, text, _RULES)
    try:
        expr = ctx.expect(tree, expected)
    except ExprErrors as failure:
        raise ExprErrors([*ctx.errors, *failure.errors]) from None
    if ctx.errors:
        raise ExprErrors(ctx.errors, expr)
    return expr


def expression(text: str, scope: Scope, expected: Type | None = None) -> Expr:
    """`parse` and `check` in one go; raises `ExprErrors`."""
    return check(parse(text), text, scope, expected)
