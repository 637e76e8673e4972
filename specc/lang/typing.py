"""Syntax to typed expressions: the rule for every kind of syntax, calls of operators among them."""

from __future__ import annotations

import ast
from typing import Any

from specc.lang import functions, names, operators
from specc.lang.builtins import BUILTIN_NAMES, FUNCTIONS, RESERVED
from specc.lang.context import (
    Bindings,
    Context,
    fits,
    has_variables,
    mismatch_help,
    needs_context,
    substitute,
    unify,
    with_item_if_needed,
)
from specc.lang.errors import (
    NEEDS_CONTEXT,
    ExprError,
    ExprErrors,
    Origin,
    Scope,
    unknown_name,
)
from specc.lang.parse import parse, span
from specc.model.expr import Call, Expr, Unknown, source_name
from specc.model.system import Operator
from specc.model.types import Type

# Typing rules of calls: operators, whose frame variables are bound by their arguments.


def call(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """Type a call of an operator or a function of the language."""
    if not isinstance(node.func, ast.Name):
        message = f"`{ctx.quote(node.func)}` cannot be called"
        raise ctx.error(node.func, message, "operators have plain names", "E0302")
    if node.keywords:
        message = "arguments are given by position"
        raise ctx.error(node.keywords[0], message, "leave the name out", "E0302")
    name = node.func.id
    function, operator = FUNCTIONS.get(name), ctx.scope.operators.get(name)
    if function and function.rule and not (operator and function.is_overridable):
        return function.rule(ctx, node, hint)
    if operator is None:
        if ctx.scope.value(name):
            message = f"`{name}` is not an operator"
            help = "a value is not called; leave the brackets out"
            raise ctx.error(node.func, message, help, "E0201")
        known, way = [*ctx.scope.operators, *BUILTIN_NAMES], "declare it under `operators:`"
        raise unknown_name("operator", name, known, way, span(node.func), "E0201")
    return _OperatorCall(ctx, node, operator, hint).check()


class _OperatorCall:
    """One call of an operator. Arguments with a type of their own come first: they bind frames."""

    def __init__(self, ctx: Context, node: ast.Call, operator: Operator, hint: Type | None) -> None:
        self.ctx = ctx
        self.node = node
        self.operator = operator
        self.name = source_name(operator.name)
        self.hint = hint
        self.bindings: Bindings = {}
        self.has_mismatch = False

    def check(self) -> Expr:
        parameters, args = self.operator.parameters, self.node.args
        if len(args) != len(parameters):
            raise ExprErrors([self._wrong_number(), *self._inner_errors()])
        order = sorted(range(len(args)), key=lambda i: needs_context(args[i], self.ctx.scope))
        found: dict[int, Expr] = {}
        errors: list[ExprError] = []
        for index in order:
            if errors and self._needs_frames(args[index], parameters[index][1]):
                continue
            try:
                found[index] = self._argument(args[index], *parameters[index])
            except ExprErrors as failure:
                errors += failure.errors
        if errors:
            return self._recover(found, ExprErrors(errors))
        ordered = tuple(found[i] for i in range(len(args)))
        result = substitute(self.operator.result, self.bindings)
        return Call(self.operator.name, ordered, type=result, span=span(self.node))

    def _recover(self, found: dict[int, Expr], failure: ExprErrors) -> Expr:
        """Make the call if each failed argument is wrong in itself; else raises `failure`."""
        result = substitute(self.operator.result, self.bindings)
        if self.has_mismatch or has_variables(result):
            raise failure
        self.ctx.errors.extend(failure.errors)
        wanted = [substitute(pattern, self.bindings) for _, pattern in self.operator.parameters]
        unknown = (
            Unknown(self.ctx.quote(n), type=t, span=span(n))
            for n, t in zip(self.node.args, wanted, strict=True)
        )
        ordered = tuple(found.get(i, other) for i, other in enumerate(unknown))
        return Call(self.operator.name, ordered, type=result, span=span(self.node))

    def _inner_errors(self) -> list[ExprError]:
        """What is wrong with arguments wherever they belong."""
        found: list[ExprError] = []
        for node in self.node.args:
            try:
                self.ctx.infer_any(node)
            except ExprErrors as failure:
                found += (e for e in failure.errors if e.code not in NEEDS_CONTEXT)
        return found

    def _needs_frames(self, node: ast.expr, pattern: Type) -> bool:
        """Whether an argument has its frames from others; if those failed, it would fail too."""
        open_frames = has_variables(substitute(pattern, self.bindings))
        return open_frames and needs_context(node, self.ctx.scope)

    def _argument(self, node: ast.expr, name: str, pattern: Type) -> Expr:
        wanted = substitute(pattern, self.bindings)
        if self.hint is not None and self._needs_frames(node, pattern):
            unify(self.operator.result, self.hint, self.bindings)
            wanted = substitute(pattern, self.bindings)
        expr = self.ctx.infer_any(node, None if has_variables(wanted) else wanted)
        expr = with_item_if_needed(self.ctx.require_complete(node, expr, wanted), wanted)
        if fits(expr.type, wanted) or unify(wanted, expr.type, self.bindings):
            return expr
        self.has_mismatch = True
        quoted = self.ctx.quote(node)
        message = f"`{quoted}` is `{expr.type}`; `{self.name}` takes `{name}: {wanted}`"
        help = mismatch_help(expr, wanted, quoted, self.ctx.scope)
        bound = [f for f in dict.fromkeys(pattern.frames) if f in self.bindings]
        if bound and not help:
            given = " and ".join(f"`{f[1:]}` is `{self.bindings[f]}`" for f in bound)
            help = f"by the other arguments {given}"
        declaration = Origin(self.operator.place, f"`{self.name}` takes `{name}: {pattern}`")
        error = self.ctx.error(node, message, help, "E0315")
        raise error.with_origins([*self.ctx.origins(expr), declaration])

    def _wrong_number(self) -> ExprError:
        name, parameters = self.name, self.operator.parameters
        usage = f"{name}({', '.join(f'{p}: {t}' for p, t in parameters)})"
        count = {0: "no arguments", 1: "1 argument"}.get(len(parameters))
        count = count or f"{len(parameters)} arguments"
        message = f"`{name}` takes {count}, not {len(self.node.args)}"
        error = self.ctx.error(self.node, message, f"it is called as `{usage}`", "E0315")
        return error.with_origins([Origin(self.operator.place, f"`{name}` is declared here")])


# The rule for every kind of syntax, and the way in.


# A rule takes its own kind of node, which the key of the table guarantees.
_RULES: dict[type[ast.expr], Any] = {
    ast.Constant: names.constant,
    ast.List: names.items,
    ast.Name: names.name,
    ast.Attribute: names.attribute,
    ast.Subscript: names.subscript,
    ast.BinOp: operators.binary,
    ast.UnaryOp: operators.unary,
    ast.BoolOp: operators.boolean,
    ast.Compare: operators.comparison,
    ast.IfExp: operators.choice,
    ast.Set: operators.unexpected_set,
    ast.Call: call,
    ast.GeneratorExp: functions.stray_generator,
}


def check(tree: ast.expr, text: str, scope: Scope, expected: Type | None = None) -> Expr:
    """The typed expression of a tree that `parse` made of `text`.

    Raises:
        ExprErrors: everything that is wrong; an error has no follow-up errors.
    """
    ctx = Context(scope, text, _RULES, RESERVED, [])
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
