"""The names that texts of a specification mention."""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Collection, Iterator
from dataclasses import replace

from specc.frozen import frozen
from specc.lang import RESERVED, ExprError
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


_HEAD = "def _"
_FRAMES = {"pose": 2, "wrench": 1, "twist": 1, "spatial": 1}
_SIZES = {"vector": 1, "image": 2}


def type_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """Types, frames and sizes in the text of a type; `types` tells type names from units."""
    tree = _tree(text)
    if tree is not None:
        yield from _in_type(tree, types)


def interface_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """The interface that a buffer names, and the frames and types that it is given."""
    match _tree(text):
        case ast.Name() as head:
            yield _mention("interface", head)
        case ast.Subscript(value=ast.Name() as head, slice=inner):
            yield _mention("interface", head)
            for item in _items(inner):
                if isinstance(item, ast.Name):
                    yield Mention(("frame", "type"), item.id, *span(item))
                else:
                    yield from _in_type(item, types)


def signature_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """Types, frames and sizes in a signature, whose parts are annotations of Python."""
    for node in _annotations(text):
        for found in _in_type(node, types):
            yield replace(found, start=found.start - len(_HEAD), end=found.end - len(_HEAD))


def enum_members(text: str) -> Iterator[Mention]:
    """The members that `enum[a, b]` declares."""
    match _tree(text):
        case ast.Subscript(value=ast.Name(id="enum"), slice=inner):
            for node in _items(inner):
                if isinstance(node, ast.Name):
                    yield _mention("member", node)


def _tree(text: str) -> ast.expr | None:
    try:
        return parse_syntax(text)
    except ExprError:
        return None


def _annotations(text: str) -> list[ast.expr]:
    # Columns are offsets in a text of one line and of one byte a character.
    if not text.isascii() or any(char in text for char in "\n\r\0"):
        return []
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            (function,) = ast.parse(f"{_HEAD}{text}: 0").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    if not isinstance(function, ast.FunctionDef):
        return []
    found = [argument.annotation for argument in function.args.args]
    return [node for node in (*found, function.returns) if node is not None]


def _in_type(node: ast.expr, types: Collection[str]) -> Iterator[Mention]:
    match node:
        case ast.Name(id=name) if name in types:
            yield _mention("type", node)
        case ast.Subscript(value=ast.Name(id=name) as head, slice=inner):
            items = _items(inner)
            if name in types:
                yield _mention("type", head)
                yield from _frames(items)
            elif name in _FRAMES:
                yield from _frames(items[: _FRAMES[name]])
            elif name in _SIZES:
                yield from _sizes(items[: _SIZES[name]])
                yield from (m for item in items[_SIZES[name] :] for m in _in_type(item, types))
            elif name in ("list", "nonempty", "optional", "partial"):
                yield from _in_type(items[-1], types)


def _items(node: ast.expr) -> list[ast.expr]:
    return node.elts if isinstance(node, ast.Tuple) and node.elts else [node]


def _frames(nodes: list[ast.expr]) -> Iterator[Mention]:
    for node in nodes:
        if isinstance(node, ast.Name):
            yield _mention("frame", node)


def _sizes(nodes: list[ast.expr]) -> Iterator[Mention]:
    for node in nodes:
        if isinstance(node, ast.Name):
            yield _mention("parameter", node)


def _mention(kind: SymbolKind, node: ast.Name) -> Mention:
    return Mention((kind,), node.id, *span(node))
