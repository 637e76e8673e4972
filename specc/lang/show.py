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
    match expr:
        case m.Number(value=value, type=type_):
            text = str(value) if isinstance(type_, Int) else repr(float(value))
            if isinstance(type_, Real) and type_.unit != DIMENSIONLESS:
                text = f"{text.removesuffix('.0')}[{type_.unit}]"
            own = _NEGATION if text.startswith("-") else _ATOM
        case m.Builtin(name=name, args=args) if FUNCTIONS[name].rule is None:
            form = FUNCTIONS[name].form(args[0].type)
            if not isinstance(form, Form):  # nobody wrote it at all
                return _print(args[0])
            text, own = form.text.format(*map(_ArgumentPlace, args)), _RANKS[form.binding]
        case m.Unary():
            text, own = _unary(expr)
        case m.Binary(op=op, left=left, right=right):
            own = _RANKS[SIGNS[op].binds]
            sides = (_ATOM, _NEGATION) if op == "**" else (own, own + 1)
            text = f"{_within(left, sides[0])} {op} {_within(right, sides[1])}"
        case m.Compare(op=op, left=left, right=right):
            text, own = f"{_within(left, _SUM)} {op} {_within(right, _SUM)}", _COMPARISON
        case m.IsOneOf():
            text, own = _among(expr, "in"), _COMPARISON
        case m.IsNone():
            text, own = _is_none(expr, "is"), _COMPARISON
        case m.Unwrap(value=inner):
            text, own = _print(inner)
        case m.Logic(op=op, operands=operands):
            own = _AND if op == "and" else _OR
            text = f" {op} ".join(_within(operand, own + 1) for operand in operands)
        case m.Choice(test=test, then=then, otherwise=otherwise):
            branches = _within(then, _OR), _within(otherwise, _CHOICE)
            text, own = f"{branches[0]} if {_within(test, _OR)} else {branches[1]}", _CHOICE
        case _:
            text, own = _ATOMS[type(expr)](expr), _ATOM
    return text, own


@dataclass(frozen=True, slots=True)
class _ArgumentPlace:
    """An argument in a form, which says how tightly it has to bind."""

    arg: m.Expr

    def __format__(self, binding: str) -> str:
        return _within(self.arg, _RANKS[binding])


def _within(expr: m.Expr, binding: int) -> str:
    """Text, in brackets if it binds less tightly than its surroundings."""
    text, own = _print(expr)
    return text if own >= binding else f"({text})"


def _unary(expr: m.Unary) -> tuple[str, int]:
    if expr.op == "-":
        return f"-{_within(expr.operand, _NEGATION)}", _NEGATION
    if isinstance(expr.operand, m.IsOneOf):
        return _among(expr.operand, "not in"), _COMPARISON
    if isinstance(expr.operand, m.IsNone):
        return _is_none(expr.operand, "is not"), _COMPARISON
    return f"not {_within(expr.operand, _NOT)}", _NOT


def _among(expr: m.IsOneOf, word: str) -> str:
    assert isinstance(expr.item.type, Enum)  # typing guarantees it
    members = ", ".join(name for name in expr.item.type.members if name in expr.members)
    return f"{_within(expr.item, _SUM)} {word} {{{members}}}"


def _is_none(expr: m.IsNone, word: str) -> str:
    return f"{_within(expr.value, _SUM)} {word} None"


def _component(expr: m.Component) -> str:
    value = _within(expr.value, _ATOM)
    if isinstance(expr.value.type, Spatial):
        return f"{value}.{expr.value.type.names[expr.index]}"
    return f"{value}[{expr.index}]"


def _listed(items: tuple[m.Expr, ...]) -> str:
    return ", ".join(map(show, items))


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
    m.Live: lambda e: e.name,
    m.FileRef: lambda e: m.source_name(e.name),
    m.BoundVariable: lambda e: e.name,
    m.ParameterRef: lambda e: e.name,
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
    m.Quantifier: lambda e: f"{e.kind}({show(e.body)} for {e.variable} in {_within(e.over, _OR)})",
}
