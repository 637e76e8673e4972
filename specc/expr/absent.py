"""What may not be there, optional values and items of lists, where there has to be one."""

from __future__ import annotations

import ast

from specc.model.expr import Expr, Items, Nothing, Sure
from specc.model.types import ListOf, OptionalOf, Type


def is_none(node: ast.expr) -> bool:
    """Whether a node is the constant `None`."""
    return isinstance(node, ast.Constant) and node.value is None


def not_none(expr: Expr) -> Expr:
    """An expression where there has to be a value; `None` itself stays what it is."""
    if isinstance(expr.type, OptionalOf) and not isinstance(expr, Nothing):
        return Sure(expr, type=expr.type.value, span=expr.span)
    return expr


def not_empty(expr: Expr) -> Expr:
    """A list where there has to be an item; anything else as it is."""
    if isinstance(expr.type, ListOf) and not expr.type.nonempty and not isinstance(expr, Items):
        return Sure(expr, type=ListOf(expr.type.element, nonempty=True), span=expr.span)
    return expr


def served(expr: Expr, expected: Type) -> Expr:
    """An expression where `expected` may ask for a list with at least one item."""
    return not_empty(expr) if isinstance(expected, ListOf) and expected.nonempty else expr
