"""Constants of a module: declared ones, and literal arrays that need not be built every period."""

from __future__ import annotations

from specc.model import expr as e
from specc.model.system import Constant


def computed(constants: dict[str, Constant]) -> frozenset[str]:
    """Constants whose value an operator or a file gives: known when the system is built."""
    found: set[str] = set()
    for name, constant in constants.items():
        nodes = list(e.walk(constant.value))
        if any(isinstance(node, (e.Call, e.FileRef)) for node in nodes):
            found.add(name)
    while True:
        more = {
            name
            for name, constant in constants.items()
            if any(isinstance(n, e.ConstantRef) and n.name in found for n in e.walk(constant.value))
        }
        if more <= found:
            return frozenset(found)
        found |= more


def shared_name(value: e.Expr) -> str:
    """Name of a literal array that says what it holds, whatever it is for; "" if there is none."""
    match value:
        case e.Items(items=items) if items and all(isinstance(item, e.Unused) for item in items):
            return f"UNUSED_{len(items)}"
        case e.Items(items=items) if items and all(_is_zero(item) for item in items):
            return f"ZERO_{len(items)}"
        case e.Builtin(name="identity"):
            return "IDENTITY"
    return ""


def _is_zero(item: e.Expr) -> bool:
    return isinstance(item, e.Number) and item.value == 0
