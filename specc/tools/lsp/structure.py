"""The names that texts of a specification mention."""

from __future__ import annotations

import ast
from collections.abc import Collection, Iterator

from specc.frozen import frozen
from specc.lang import ExprError
from specc.lang.mentioned import (
    NameKind,
    NameMention,
    names_of_interface,
    names_of_signature,
    names_of_type,
)
from specc.lang.parse import parse_syntax, span
from specc.schema.keys import SymbolKind


@frozen
class Mention:
    """A name in a text: where it is and the kinds of symbol it may be, the likeliest first."""

    kinds: tuple[SymbolKind, ...]
    name: str
    start: int
    end: int


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
