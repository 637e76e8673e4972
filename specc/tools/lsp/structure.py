"""The names that texts of a specification mention."""

from __future__ import annotations

import ast
import re
from collections.abc import Collection, Iterator

from specc.frozen import frozen
from specc.lang import RESERVED, ExprError
from specc.lang.mentioned import (
    NameKind,
    NameMention,
    names_of_interface,
    names_of_signature,
    names_of_type,
)
from specc.lang.parse import parse_syntax, span
from specc.model import expr as m
from specc.model.types import Enum, Record, Type
from specc.schema.keys import SymbolKind

# The names that an expression mentions, and what each of them is.


NAME = re.compile(r"[^\W\d]\w*")
_INPUT = re.compile(r"\bx\s*\.\s*(\w+)\s*\.\s*(\w+)")
_LITERAL = re.compile(r"\d\s*\[[^\]]*\]|\"[^\"]*\"|'[^']*'")
_VARIABLE = re.compile(r"\bfor\s+(\w+)\s+in\b")
_PLAIN: tuple[SymbolKind, ...] = ("memory", "let", "parameter", "constant", "file")


@frozen
class Mention:
    """A name in a text: where it is and the kinds of symbol it may be, the likeliest first.

    A name inside something else is qualified: `x.peer.element`, `Record.field`, `Enum.member`;
    one of a variable carries the offset of its declaration. `type` is that of the value.
    """

    kinds: tuple[SymbolKind, ...]
    name: str
    start: int
    end: int
    type: Type | None = None


def mentions(expr: m.Expr, text: str) -> Iterator[Mention]:
    """The names in a typed expression, each known for what it is."""
    yield from _in_node(expr, text, {})


def _in_node(expr: m.Expr, text: str, variables: dict[str, int]) -> Iterator[Mention]:
    start, end = expr.span
    plain = _PLAIN_NODES.get(type(expr))
    match expr:
        case m.MemoryRef() | m.LetRef() | m.ConstantRef() | m.FileRef() if plain:
            yield Mention(plain, m.written(expr.name), start, end, expr.type)
        case m.BoundVariable() if expr.name in variables:
            declared = f"{expr.name}@{variables[expr.name]}"
            yield Mention(("variable",), declared, start, end, expr.type)
        case m.Member(type=Enum() as enum):
            yield Mention(("member",), f"{enum.name}.{expr.name}", start, end, enum)
        case m.Input():
            yield from _input(expr, text)
        case m.Call() if text.startswith(name := m.written(expr.operator), start):
            yield Mention(("operator",), name, start, start + len(name))
        case m.FieldOf(value=m.Node(type=Record() as record)):
            name = f"{record.name}.{expr.name}"
            yield Mention(("field",), name, end - len(expr.name), end, expr.type)
        case m.Among(item=m.Node(type=Enum() as enum)):
            yield from _members(expr, enum, text)
        case m.Quantifier() if declared_at := _declaration(expr, text):
            variables = {**variables, expr.variable: declared_at}
            end = declared_at + len(expr.variable)
            yield Mention(("variable",), f"{expr.variable}@{declared_at}", declared_at, end)
    for child in m.children(expr):
        yield from _in_node(child, text, variables)


_PLAIN_NODES: dict[type, tuple[SymbolKind, ...]] = {
    m.MemoryRef: ("memory",),
    m.LetRef: ("let",),
    m.ConstantRef: ("parameter", "constant"),
    m.FileRef: ("file",),
}


def _input(expr: m.Input, text: str) -> Iterator[Mention]:
    found = _INPUT.match(text, expr.span[0])
    if found:
        yield Mention(("subsystem",), f"x.{expr.peer}", *found.span(1))
        name = f"x.{expr.peer}.{expr.element}"
        yield Mention(("element",), name, *found.span(2), expr.type)


def _members(expr: m.Among, enum: Enum, text: str) -> Iterator[Mention]:
    opening = text.find("{", expr.item.span[1], expr.span[1])
    if opening >= 0:
        for found in NAME.finditer(text, opening, expr.span[1]):
            name = f"{enum.name}.{found.group()}"
            yield Mention(("member",), name, *found.span(), enum)


def _declaration(expr: m.Quantifier, text: str) -> int:
    """Where a quantifier declares its variable; 0, where none can be, if that is not found."""
    for found in _VARIABLE.finditer(text, expr.body.span[1], expr.over.span[0]):
        if found.group(1) == expr.variable:
            return found.start(1)
    return 0


def guesses(text: str) -> Iterator[Mention]:
    """The names in a text that could not be typed, each with all that it might be."""
    hidden = [found.span() for found in _LITERAL.finditer(text)]
    variables = {found.group(1) for found in _VARIABLE.finditer(text)}
    for found in _INPUT.finditer(text):
        peer, element = found.groups()
        yield Mention(("subsystem",), f"x.{peer}", *found.span(1))
        yield Mention(("element",), f"x.{peer}.{element}", *found.span(2))
    for found in NAME.finditer(text):
        start, end = found.span()
        name = found.group()
        if name in RESERVED or name in variables or text[:start].rstrip().endswith("."):
            continue
        if any(first <= start < last for first, last in hidden):
            continue
        called = text[end:].lstrip().startswith("(")
        yield Mention(("operator",) if called else _PLAIN, name, start, end)


# The names that the texts of types and signatures mention.


_KINDS: dict[NameKind, tuple[SymbolKind, ...]] = {
    "type": ("type",),
    "interface": ("interface",),
    "frame": ("frame",),
    "argument": ("frame", "type"),
    "size": ("parameter",),
}


def type_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """Types, frames and sizes in the text of a type; `types` tells type names from units."""
    yield from map(_mention, names_of_type(text, types))


def interface_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """The interface that a buffer names, and the frames and types that it is given."""
    yield from map(_mention, names_of_interface(text, types))


def signature_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """Types, frames and sizes in a signature."""
    yield from map(_mention, names_of_signature(text, types))


def _mention(named: NameMention) -> Mention:
    return Mention(_KINDS[named.kind], named.name, named.start, named.end)


def enum_members(text: str) -> Iterator[Mention]:
    """The members that `enum[a, b]` declares."""
    try:
        tree = parse_syntax(text)
    except ExprError:
        return
    match tree:
        case ast.Subscript(value=ast.Name(id="enum"), slice=inner):
            for node in inner.elts if isinstance(inner, ast.Tuple) else (inner,):
                if isinstance(node, ast.Name):
                    yield Mention(("member",), node.id, *span(node))
