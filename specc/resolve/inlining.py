"""Constants of a described file stand for their values: only those of the main file are shared."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from specc.expr import ExprError
from specc.limits import MAX_EXPRESSION_PARTS
from specc.model.expr import ConstantRef, Expr, Node
from specc.model.system import Constant


def inlined(expr: Expr, constants: Mapping[str, Constant], kept: Collection[str] = ()) -> Expr:
    """`expr` with the values of constants in the place of their names, but for those that are kept.

    Raises:
        ExprError: the values have too many parts; constants of constants can stand for billions.
    """
    return _Inlining(constants, kept).of(expr) if constants else expr


@dataclass(slots=True)
class _Inlining:
    constants: Mapping[str, Constant]
    kept: Collection[str]
    inside: int = 0
    """How many constants are being written out, one in the other."""
    parts: int = 0

    def of(self, expr: Expr) -> Expr:
        if self.inside:
            self._count(expr)
        if isinstance(expr, ConstantRef):
            return self._value(expr)
        changed: dict[str, Any] = {}
        for name in expr.__match_args__:
            part = getattr(expr, name)
            if isinstance(part, tuple):
                new: Any = tuple(map(self._in, part))
            else:
                new = self._in(part)
            if new != part:
                changed[name] = new
        return replace(expr, **changed) if changed else expr

    def _value(self, expr: ConstantRef) -> Expr:
        found = None if expr.name in self.kept else self.constants.get(expr.name)
        if found is None:
            return expr
        self.inside += 1
        value = replace(self.of(found.value), span=expr.span)
        self.inside -= 1
        return value

    def _in(self, part: Any) -> Any:
        return self.of(part) if isinstance(part, Node) else part  # type: ignore[arg-type]  # every Node subclass is a member of Expr

    def _count(self, expr: Expr) -> None:
        self.parts += 1
        if self.parts > MAX_EXPRESSION_PARTS:
            message = f"with its constants written out, this has over {MAX_EXPRESSION_PARTS} parts"
            raise ExprError(message, *expr.span, "compute the value in an operator", "E0017")
