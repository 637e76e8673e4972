"""The names that texts of types and signatures mention: types, frames and sizes."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Literal

from specc.lang.errors import ExprError
from specc.lang.parse import parse_syntax, span
from specc.lang.signatures import signature_parts
from specc.lang.types import SHAPES, name_and_arguments

NameKind = Literal["type", "interface", "frame", "argument", "size"]


@dataclass(frozen=True, slots=True)
class NameMention:
    """A name in a text, by its position; an argument of an interface is a frame or a type."""

    kind: NameKind
    name: str
    start: int
    end: int


TextForm = Literal["type", "signature", "interface"]


def names_of(form: TextForm, text: str, types: Collection[str]) -> Iterator[NameMention]:
    """The names in the text of a type, of a signature or of an interface with its arguments."""
    return _READ[form](text, types)


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
    tree = _tree(text)
    name, items = name_and_arguments(tree) if tree is not None else ("", [])
    if tree is not None and name:
        yield _head_mention("interface", tree, name)
    for item in items:
        if isinstance(item, ast.Name):
            yield _mention("argument", item)
        else:
            yield from _in_type(item, types)


_READ = {"type": names_of_type, "signature": names_of_signature, "interface": names_of_interface}


def _tree(text: str) -> ast.expr | None:
    try:
        return parse_syntax(text)
    except ExprError:
        return None


def _in_type(node: ast.expr, types: Collection[str]) -> Iterator[NameMention]:
    name, items = name_and_arguments(node)
    if name in types:
        yield _head_mention("type", node, name)
        yield from (m for item in items for m in _plain_mention("frame", item))
    elif name in SHAPES:
        for taken, item in zip(SHAPES[name].takes, items, strict=False):
            if taken == "frame" or taken == "size":
                yield from _plain_mention(taken, item)
            else:
                yield from _in_type(item, types)


def _head_mention(kind: NameKind, node: ast.expr, name: str) -> NameMention:
    """The name with which a text begins."""
    start = span(node)[0]
    return NameMention(kind, name, start, start + len(name))


def _plain_mention(kind: NameKind, node: ast.expr) -> Iterator[NameMention]:
    if isinstance(node, ast.Name):
        yield _mention(kind, node)


def _mention(kind: NameKind, node: ast.Name) -> NameMention:
    return NameMention(kind, node.id, *span(node))
