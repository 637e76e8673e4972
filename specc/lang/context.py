"""What the type rules share while they go through one expression."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TypeVar

from specc.frozen import frozen
from specc.lang.errors import ExprError, ExprErrors, Origin, Scope, origins
from specc.lang.mismatch import fits, way_out
from specc.lang.parse import span
from specc.model.expr import Expr, Items, Nothing, Sure, Unknown
from specc.model.types import Bool, ListOf, OptionalOf, PartialOf, Type

# What may not be there, optional values and items of lists, where there has to be one.


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


# What the typing rules share: the scope, the text, and how they fail and go on.


Rule = Callable[["Context", ast.expr, "Type | None"], Expr]
"""Types one kind of syntax. The type is a hint for literals; whether it fits is checked outside."""

T = TypeVar("T")

_SHOWN = 40


@frozen
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
                f"`None` is not a `{expected}`",
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
