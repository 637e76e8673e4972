"""The names that texts of types and signatures mention: types, frames and sizes."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator
from typing import Literal

from specc.frozen import frozen
from specc.lang.errors import ExprError
from specc.lang.parse import parse_syntax, span
from specc.lang.types import signature_parts

_FRAMES = {"pose": 2, "wrench": 1, "twist": 1, "spatial": 1}
_SIZES = {"vector": 1, "image": 2}


NameKind = Literal["type", "interface", "frame", "argument", "size"]


@frozen
class NameMention:
    """A name in a text, by its position; an argument of an interface is a frame or a type."""

    kind: NameKind
    name: str
    start: int
    end: int


def names_of_type(text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The names in the text of a type; `types` tells type names from units.

    A text that cannot be read has none, here and below.
    """
    tree = _tree(text)
    if tree is not None:
        yield from _in_type(tree, types)


def names_of_signature(text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The names in the types of a signature."""
    try:
        parts, (start, end) = signature_parts(text)
    except ExprError:
        return
    typed = [(text.find(":", first, last) + 1, last) for first, last in parts]
    for first, last in (*typed, (start, end)):
        for found in names_of_type(text[first:last], types):
            yield NameMention(found.kind, found.name, found.start + first, found.end + first)


def names_of_interface(text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The interface that a buffer names, and the frames and types that it is given."""
    match _tree(text):
        case ast.Name() as head:
            yield _named("interface", head)
        case ast.Subscript(value=ast.Name() as head, slice=inner):
            yield _named("interface", head)
            for item in _items(inner):
                if isinstance(item, ast.Name):
                    yield _named("argument", item)
                else:
                    yield from _in_type(item, types)


def _tree(text: str) -> ast.expr | None:
    try:
        return parse_syntax(text)
    except ExprError:
        return None


def _in_type(node: ast.expr, types: Collection[str]) -> Iterator[NameMention]:
    match node:
        case ast.Name(id=name) if name in types:
            yield _named("type", node)
        case ast.Subscript(value=ast.Name(id=name) as head, slice=inner):
            items = _items(inner)
            if name in types:
                yield _named("type", head)
                yield from _plain("frame", items)
            elif name in _FRAMES:
                yield from _plain("frame", items[: _FRAMES[name]])
            elif name in _SIZES:
                yield from _plain("size", items[: _SIZES[name]])
                yield from (m for item in items[_SIZES[name] :] for m in _in_type(item, types))
            elif name in ("list", "nonempty", "optional", "partial"):
                yield from _in_type(items[-1], types)


def _items(node: ast.expr) -> list[ast.expr]:
    return node.elts if isinstance(node, ast.Tuple) and node.elts else [node]


def _plain(kind: NameKind, nodes: list[ast.expr]) -> Iterator[NameMention]:
    for node in nodes:
        if isinstance(node, ast.Name):
            yield _named(kind, node)


def _named(kind: NameKind, node: ast.Name) -> NameMention:
    return NameMention(kind, node.id, *span(node))
