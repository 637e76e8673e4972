"""Exact comparisons of poses and vectors, which are refused but mean something."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from specc.model import expr as m
from specc.model.types import Bool, Pose, Real, Spatial, Type, Vector


def runnable(expr: m.Expr) -> m.Expr:
    """The expression with `a == b` of arrays as `near` with no tolerance, which can be run."""
    changed: dict[str, Any] = {}
    for name in expr.__match_args__:
        part = getattr(expr, name)
        if isinstance(part, m.Node):
            changed[name] = runnable(part)  # type: ignore[arg-type]  # every Node is an Expr
        elif isinstance(part, tuple):
            changed[name] = tuple(runnable(p) if isinstance(p, m.Node) else p for p in part)  # type: ignore[arg-type]  # as above
    same = replace(expr, **changed)
    if isinstance(same, m.Compare) and _is_array(same.left.type):
        return _near(same)
    return same


def _is_array(type_: Type) -> bool:
    return isinstance(type_, (Pose, Spatial)) or (
        isinstance(type_, Vector) and isinstance(type_.element, Real)
    )


def _near(compared: m.Compare) -> m.Expr:
    zeros = 2 if isinstance(compared.left.type, Pose) else 1
    tolerances = (m.Number(0.0, type=Real()),) * zeros
    near = m.Builtin("near", (compared.left, compared.right, *tolerances), type=Bool())
    return near if compared.op == "==" else m.Unary("not", near, type=Bool())
