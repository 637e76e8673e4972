"""Places inside the texts of expressions."""

from __future__ import annotations

from dataclasses import replace

from specc.model.expr import Expr
from specc.source import Place


def text_place(part: Place, key: str, expr: Expr) -> Place:
    """Where `expr` stands in the text at `key` of a part (its own text in the short form)."""
    start, end = expr.span
    return replace(part, route=(*part.route, key), part="value", start=start, end=end)


def below(part: Place, *keys: str | int) -> Place:
    """The value at `keys` of a part, or the nearest thing around it that the file has."""
    return replace(part, route=(*part.route, *keys), part="value")
