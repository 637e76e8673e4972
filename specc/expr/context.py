"""What the typing rules share: the scope, the text, and how they fail and go on."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar

from specc.expr.absent import is_none, not_none, served
from specc.expr.errors import ExprError, ExprErrors
from specc.expr.mismatch import fits, way_out
from specc.expr.origin import Origin, origins
from specc.expr.parse import span
from specc.expr.scope import Scope
from specc.model.expr import Expr, Unknown
from specc.model.types import Bool, OptionalOf, PartialOf, Type

Rule = Callable[["Context", ast.expr, "Type | None"], Expr]
"""Types one kind of syntax. The type is a hint for literals; whether it fits is checked outside."""

T = TypeVar("T")

_SHOWN = 40


@dataclass(frozen=True, slots=True)
class Context:
    """One expression being typed. `rules` has a rule for every kind of syntax in the language."""

    scope: Scope
    text: str
    rules: Mapping[type[ast.expr], Rule]
    errors: list[ExprError] = field(default_factory=list)
    """What was found wrong where the typing could go on."""

    def infer(self, node: ast.expr, hint: Type | None = None) -> Expr:
        """The typed expression; literals take the hinted type if they can.

        Where nothing else is hinted, all of its value has to be there.
        """
        return self.whole(node, self.infer_any(node, hint), hint)

    def infer_any(self, node: ast.expr, hint: Type | None = None) -> Expr:
        """The typed expression, where None and missing components will do."""
        if isinstance(hint, OptionalOf) and not isinstance(node, ast.IfExp) and not is_none(node):
            hint = hint.value
        if isinstance(hint, PartialOf) and not isinstance(node, (ast.IfExp, ast.List)):
            hint = hint.value
        return self.rules[type(node)](self, node, hint)

    def whole(self, node: ast.expr, expr: Expr, wanted: Type | None) -> Expr:
        """An expression that is there, with all components, unless less is wanted."""
        expr = expr if isinstance(wanted, OptionalOf) else not_none(expr)
        if isinstance(expr.type, PartialOf) and not isinstance(wanted, (OptionalOf, PartialOf)):
            message = f"`{self.quote(node)}` is `{expr.type}`, which may lack components"
            raise self.error(node, message, code="E0321").because(self.origins(expr))
        return expr

    def expect(self, node: ast.expr, expected: Type | None) -> Expr:
        """The typed expression, which must be of the expected type if there is one."""
        if expected is None:
            return self.infer_any(node)
        expr = served(self.infer(node, expected), expected)
        if fits(expr.type, expected):
            return expr
        message = f"`{self.quote(node)}` is `{expr.type}`; expected `{expected}`"
        help = way_out(expr, expected, self.quote(node), self.scope)
        if is_none(node):
            message, help = (
                f"`None` is no `{expected}`",
                f"what may be `None` is `optional[{expected}]`",
            )
        raise self.error(node, message, help).because(self.origins(expr), expected)

    def truth(self, node: ast.expr) -> Expr:
        """The typed condition; one with an error in it is an unknown truth value."""
        try:
            return self.expect(node, Bool())
        except ExprErrors as failure:
            return self.unknown(node, Bool(), failure)

    def unknown(self, node: ast.expr, type: Type, failure: ExprErrors) -> Expr:
        """A value of a type that is certain although something inside has an error."""
        self.errors.extend(failure.errors)
        start, end = span(node)
        return Unknown(self.text[start:end], type=type, span=(start, end))

    def each(self, *jobs: Callable[[], T]) -> list[T]:
        """Results of independent jobs; if some fail, the errors of all of them at once."""
        results: list[T] = []
        errors: list[ExprError] = []
        for job in jobs:
            try:
                results.append(job())
            except ExprErrors as found:
                errors += found.errors
        if errors:
            raise ExprErrors(errors)
        return results

    def inside(self, scope: Scope) -> Context:
        """The same expression in the scope of a quantifier."""
        return replace(self, scope=scope)

    def quote(self, node: ast.expr) -> str:
        """The text of a node as it was written, on one line and shortened."""
        start, end = span(node)
        words = " ".join(self.text[start:end].split())
        return words if len(words) <= _SHOWN else words[: _SHOWN - 3] + "..."

    def origins(self, *exprs: Expr) -> list[Origin]:
        """The declarations that gave expressions their types."""
        return [origin for expr in exprs for origin in origins(expr, self.scope)]

    def error(
        self, node: ast.expr | ast.keyword, message: str, help: str = "", code: str = "E0310"
    ) -> ExprError:
        """An error about a node, to be raised."""
        return ExprError(message, *span(node), help, code)
