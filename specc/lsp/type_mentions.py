"""The names that the texts of types and signatures mention."""

from __future__ import annotations

import ast
import warnings
from collections.abc import Collection, Iterator
from dataclasses import replace

from specc.expr import ExprError
from specc.expr.parse import parse_syntax, span
from specc.lsp.mentions import Mention
from specc.lsp.structure import Kind

_HEAD = "def _"
_FRAMES = {"pose": 2, "wrench": 1, "twist": 1, "spatial": 1}


def type_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """Types and frames in the text of a type; `types` tells the names of types from units."""
    tree = _tree(text)
    if tree is not None:
        yield from _in_type(tree, types)


def signature_mentions(text: str, types: Collection[str]) -> Iterator[Mention]:
    """Types and frames in a signature, whose parts are annotations of Python."""
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
            elif name in ("list", "nonempty", "optional", "partial", "vector"):
                yield from _in_type(items[-1], types)


def _items(node: ast.expr) -> list[ast.expr]:
    return node.elts if isinstance(node, ast.Tuple) and node.elts else [node]


def _frames(nodes: list[ast.expr]) -> Iterator[Mention]:
    for node in nodes:
        if isinstance(node, ast.Name):
            yield _mention("frame", node)


def _mention(kind: Kind, node: ast.Name) -> Mention:
    return Mention((kind,), node.id, *span(node))
