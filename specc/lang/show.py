"""Typed expressions back to text of the language: what is shown reads back as the same tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from specc.lang.builtins import FUNCTIONS
from specc.lang.functions import Form
from specc.lang.values import SIGNS
from specc.model import expr as m
from specc.model.types import Enum, Int, Real, Spatial
from specc.model.units import DIMENSIONLESS

_CHOICE, _OR, _AND, _NOT, _COMPARISON, _SUM, _PRODUCT, _NEGATION, _POWER, _ATOM = range(10)
_RANKS = {"": _CHOICE, "sum": _SUM, "product": _PRODUCT, "power": _POWER, "primary": _ATOM}


def show(expr: m.Expr) -> str:
    """The canonical text of an expression; numbers in SI units, brackets only where needed."""
    return _print(expr)[0]


def _print(expr: m.Expr) -> tuple[str, int]:
    """Text, and how tightly its outermost operator binds."""
    if isinstance(expr, m.Builtin) and FUNCTIONS[expr.name].rule is None:
        return _unnamed(expr, FUNCTIONS[expr.name].form(expr.args[0].type))
    printer = _PRINTERS.get(type(expr))
    return (_ATOMS[type(expr)](expr), _ATOM) if printer is None else printer(expr)


@dataclass(frozen=True, slots=True)
class _ArgumentPlace:
    """An argument in a form, which says how tightly it has to bind."""

    arg: m.Expr

    def __format__(self, binding: str) -> str:
        return _within(self.arg, _RANKS[binding])


def _unnamed(expr: m.Builtin, form: Form | str) -> tuple[str, int]:
    """A function that nobody wrote as a call, if at all."""
    if not isinstance(form, Form):
        return _print(expr.args[0])
    return form.text.format(*map(_ArgumentPlace, expr.args)), _RANKS[form.binding]


def _within(expr: m.Expr, binding: int) -> str:
    """Text, in brackets if it binds less tightly than its surroundings."""
    text, own = _print(expr)
    return text if own >= binding else f"({text})"


def _number(expr: m.Number) -> tuple[str, int]:
    text = str(expr.value) if isinstance(expr.type, Int) else repr(float(expr.value))
    if isinstance(expr.type, Real) and expr.type.unit != DIMENSIONLESS:
        text = f"{text.removesuffix('.0')}[{expr.type.unit}]"
    return text, _NEGATION if text.startswith("-") else _ATOM


def _unary(expr: m.Unary) -> tuple[str, int]:
    if expr.op == "-":
        return f"-{_within(expr.operand, _NEGATION)}", _NEGATION
    if isinstance(expr.operand, m.IsOneOf):
        return _among(expr.operand, "not in")
    if isinstance(expr.operand, m.IsNone):
        return _is_none(expr.operand, "is not")
    return f"not {_within(expr.operand, _NOT)}", _NOT


def _binary(expr: m.Binary) -> tuple[str, int]:
    own = _RANKS[SIGNS[expr.op].binds]
    left, right = (_ATOM, _NEGATION) if expr.op == "**" else (own, own + 1)
    return f"{_within(expr.left, left)} {expr.op} {_within(expr.right, right)}", own


def _compare(expr: m.Compare) -> tuple[str, int]:
    return f"{_within(expr.left, _SUM)} {expr.op} {_within(expr.right, _SUM)}", _COMPARISON


def _among(expr: m.IsOneOf, word: str = "in") -> tuple[str, int]:
    assert isinstance(expr.item.type, Enum)  # typing guarantees it
    members = ", ".join(name for name in expr.item.type.members if name in expr.members)
    return f"{_within(expr.item, _SUM)} {word} {{{members}}}", _COMPARISON


def _is_none(expr: m.IsNone, word: str = "is") -> tuple[str, int]:
    return f"{_within(expr.value, _SUM)} {word} None", _COMPARISON


def _logic(expr: m.Logic) -> tuple[str, int]:
    own = _AND if expr.op == "and" else _OR
    return f" {expr.op} ".join(_within(item, own + 1) for item in expr.operands), own


def _choice(expr: m.Choice) -> tuple[str, int]:
    then, test = _within(expr.then, _OR), _within(expr.test, _OR)
    return f"{then} if {test} else {_within(expr.otherwise, _CHOICE)}", _CHOICE


def _component(expr: m.Component) -> str:
    value = _within(expr.value, _ATOM)
    if isinstance(expr.value.type, Spatial):
        return f"{value}.{expr.value.type.names[expr.index]}"
    return f"{value}[{expr.index}]"


def _quantifier(expr: m.Quantifier) -> str:
    return f"{expr.kind}({show(expr.body)} for {expr.variable} in {_within(expr.over, _OR)})"


def _listed(items: tuple[m.Expr, ...]) -> str:
    return ", ".join(map(show, items))


_PRINTERS: dict[type, Callable[[Any], tuple[str, int]]] = {
    m.Number: _number,
    m.Unary: _unary,
    m.Binary: _binary,
    m.Compare: _compare,
    m.IsOneOf: _among,
    m.IsNone: _is_none,
    m.Unwrap: lambda e: _print(e.value),
    m.Logic: _logic,
    m.Choice: _choice,
}
_ATOMS: dict[type, Callable[[Any], str]] = {
    m.Truth: lambda e: str(e.value),
    m.TextLiteral: lambda e: repr(e.value),
    m.Member: lambda e: e.name,
    m.Unused: lambda e: "_",
    m.Nothing: lambda e: "None",
    m.Input: lambda e: f"x.{e.peer}.{e.element}",
    m.MemoryRef: lambda e: e.name,
    m.LetRef: lambda e: e.name,
    m.ConstantRef: lambda e: e.name,
    m.FileRef: lambda e: m.source_name(e.name),
    m.BoundVariable: lambda e: e.name,
    m.Clock: lambda e: e.name,
    m.Fresh: lambda e: f"fresh({show(e.input)})",
    m.Present: lambda e: f"present({show(e.input)})",
    m.Lag: lambda e: f"{e.name}({show(e.input)})",
    m.Call: lambda e: f"{m.source_name(e.operator)}({_listed(e.args)})",
    m.Builtin: lambda e: f"{e.name}({_listed(e.args)})",
    m.Items: lambda e: f"[{_listed(e.items)}]",
    m.FieldOf: lambda e: f"{_within(e.value, _ATOM)}.{e.name}",
    m.Component: _component,
    m.Unknown: lambda e: f"?{e.name}",
    m.Quantifier: _quantifier,
}
