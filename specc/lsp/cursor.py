"""Where in the structure of a file somebody is typing, though the line is not finished.

The text up to the cursor, with a mark there and with what is open closed, is YAML more often than
not; the place of the mark in it says which key or value is being written. If it is no YAML, because
of an error above, the indentation of its lines says as much.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from specc.lsp.outline import outline
from specc.lsp.symbols import values
from specc.read import read_text
from specc.schema import ROW_KEYS
from specc.source import Node, Route

_MARK = "specc_cursor"
_BLOCK = re.compile(r"(?:^|[:\-?]\s+)[|>][+\-\d]*\s*(?:#.*)?$")
_TOKEN = re.compile(r"[\"'\[\]{}#]")
_CLOSING = {"[": "]", "{": "}"}
_ENDS = ("", "]", "}", "'", '"')
_LINE_BREAK = re.compile(r"\r\n|\r|\n")


@dataclass(frozen=True, slots=True)
class Cursor:
    """A key of the mapping at `route` or the value at it, and its text before the cursor."""

    route: Route
    is_key: bool
    before: str
    siblings: tuple[str, ...] = ()


def cursors(text: str, offset: int) -> list[Cursor]:
    """What may be being written at an offset: a value, a key, or either of them."""
    head = text[:offset]
    found = _in_head(head, *_closing(head))
    if not found:
        head = outline(head)
        found = _in_head(head, *_closing(head))
    return found


def line_break(text: str) -> str:
    """The line break of a text: that of its first line."""
    found = _LINE_BREAK.search(text)
    return found.group() if found else "\n"


def _in_head(head: str, closing: str, plausible: bool) -> list[Cursor]:
    found: dict[Cursor, None] = {}
    for ending in (closing, f": {closing}" if closing[:1] not in ("'", '"') else closing):
        if plausible:
            document = read_text("", f"{head}{_MARK}{ending}\n", ROW_KEYS)
            if document.source.spans is not None:
                found |= dict.fromkeys(_marked(document.source.spans))
    return list(found)


def _marked(top: Node) -> Iterator[Cursor]:
    if top.scalar is not None and _MARK in top.scalar:
        yield Cursor((), True, top.scalar.partition(_MARK)[0])
    for route, key, node in values(top):
        if key is not None and key.scalar and _MARK in key.scalar:
            others = [str(other) for other in _parent(top, route).keys if other != route[-1]]
            yield Cursor(route[:-1], True, key.scalar.partition(_MARK)[0], tuple(others))
        elif node.scalar is not None and _MARK in node.scalar:
            yield Cursor(_spelled(route), False, node.scalar.partition(_MARK)[0])


def _parent(top: Node, route: Route) -> Node:
    node = top
    for step in route[:-1]:
        node = node.values[step]
    return node


def _spelled(route: Route) -> Route:
    """The route without the mark, which may have become part of a key."""
    return tuple(s.partition(_MARK)[0] if isinstance(s, str) else s for s in route)


def _closing(head: str) -> tuple[str, bool]:
    """The quotes and brackets that close what a text leaves open, and whether it may be open.

    What is inside brackets or quotes stands further right than the line that opens them.
    """
    stack: list[str] = []
    quote = ""
    block: int | None = None
    opened_at = -1
    for line in _LINE_BREAK.split(head):
        indent = len(line) - len(line.lstrip())
        if block is not None and (indent > block or not line.strip()):
            continue
        block = None
        if not quote and not stack:
            opened_at = indent
        elif line.strip()[:1] not in _ENDS and indent <= opened_at:
            return "", False
        quote = _scan(line, stack, quote)
        if not quote and not stack and _BLOCK.search(line):
            block = indent
    return quote + "".join(_CLOSING[opened] for opened in reversed(stack)), True


def _scan(line: str, stack: list[str], quote: str) -> str:
    """Follow brackets and quotes through a line; the quote that is open behind it."""
    at = 0
    while found := _TOKEN.search(line, at):
        at, char = found.end(), found.group()
        if quote == "'" and line.startswith("''", at - 1):
            at += 1
        elif quote:
            escaped = quote == '"' and (at - 1 - len(line[: at - 1].rstrip("\\"))) % 2
            quote = "" if char == quote and not escaped else quote
        elif char == "#":
            if found.start() == 0 or line[found.start() - 1].isspace():
                break
        elif char in "]}":
            if stack and _CLOSING[stack[-1]] == char:
                stack.pop()
        elif (stack and char in "[{") or _starts_token(line[: found.start()]):
            if char in "[{":
                stack.append(char)
            else:
                quote = char
    return quote


def _starts_token(before: str) -> bool:
    """Whether a value or key starts here: inside plain text, quotes and brackets are letters."""
    before = before.rstrip()
    return not before or before[-1] in ":-?[{,"
