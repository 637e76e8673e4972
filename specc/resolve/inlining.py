"""Constants of a described file stand for their values: only those of the main file are shared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from specc.model.expr import ConstantRef, Expr, Node
from specc.model.system import Constant


def inlined(expr: Expr, constants: Mapping[str, Constant]) -> Expr:
    """`expr` with the values of these constants in the place of their names."""
    if not constants:
        return expr
    if isinstance(expr, ConstantRef):
        found = constants.get(expr.name)
        return expr if found is None else replace(inlined(found.value, constants), span=expr.span)
    changed: dict[str, Any] = {}
    for name in expr.__match_args__:
        part = getattr(expr, name)
        if isinstance(part, tuple):
            new: Any = tuple(_in(element, constants) for element in part)
        else:
            new = _in(part, constants)
        if new != part:
            changed[name] = new
    return replace(expr, **changed) if changed else expr


def _in(part: Any, constants: Mapping[str, Constant]) -> Any:
    return inlined(part, constants) if isinstance(part, Node) else part  # type: ignore[arg-type]  # every Node subclass is a member of Expr
