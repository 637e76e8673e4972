"""The body of a quantifier, said of one item."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from specc.model.expr import Bound, Expr, Node


def substituted(expr: Expr, variable: str, item: Expr) -> Expr:
    """`expr` with `item` in the place of the variable."""
    if isinstance(expr, Bound):
        return item if expr.name == variable else expr
    changed: dict[str, Any] = {}
    for name in expr.__match_args__:
        part = getattr(expr, name)
        if isinstance(part, tuple):
            new: Any = tuple(_in(element, variable, item) for element in part)
        else:
            new = _in(part, variable, item)
        if new != part:
            changed[name] = new
    return replace(expr, **changed) if changed else expr


def _in(part: Any, variable: str, item: Expr) -> Any:
    return substituted(part, variable, item) if isinstance(part, Node) else part  # type: ignore[arg-type]  # every Node subclass is a member of Expr
