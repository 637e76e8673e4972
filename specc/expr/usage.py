"""How many arguments a function of the language takes, and the node that a call becomes."""

from __future__ import annotations

import ast

from specc.expr.context import Context
from specc.expr.parse import span
from specc.model.expr import Builtin, Expr
from specc.model.types import Type


def take(ctx: Context, node: ast.Call, usage: str, least: int, most: int | None = -1) -> None:
    """Refuse a call with another number of arguments; `most` None is any number."""
    given = len(node.args)
    upper = least if most == -1 else most
    if given >= least and (upper is None or given <= upper):
        return
    name = usage.partition("(")[0]
    wanted = f"{least} or more" if upper is None else f"{least} or {upper}"
    wanted = str(least) if upper == least else wanted
    noun = "argument" if wanted == "1" else "arguments"
    message = f"{name} takes {wanted} {noun}, not {given}"
    raise ctx.error(node, message, f"it is called as {usage}", "E0314")


def built(node: ast.Call, type: Type, *args: Expr) -> Builtin:
    """A call of a function of the language."""
    assert isinstance(node.func, ast.Name)  # it was looked up by its name
    return Builtin(node.func.id, args, type=type, span=span(node))
