"""Where the cursor is in a text that may be unfinished."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from specc.read import read_text
from specc.schema import ROW_KEYS
from specc.source import LINE_BREAK, Route, SourceFile, TextNode

# The lines that the last line of a text lies in, known by their indentation alone.


_HEAD = re.compile(r"((?:- +)*)(\"[^\"]*\"|'[^']*'|[^\s\"'\[\]{}#:,&*!|>%@`][^:#]*?)\s*:(?=\s|$)")
_LEAVES_OPEN = re.compile(r":\s+(?:[|>][+\-\d]*\s*(?:#.*)?|[\[{\"'].*)$")
_PAIRS = {"]": "[", "}": "{"}


def outline(head: str) -> str:
    """The last line below the keys that it belongs to, and beside those next to it.

    Other values are dropped, so that no error in them matters. A value that the line above leaves
    open stays as it is.
    """
    lines = SourceFile("", head).lines
    at = _begin(lines)
    kept = ["\n".join(lines[at:])]
    column, dashed = _column(lines[at])
    for line in reversed(lines[:at]):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        here, dash = _column(line)
        above = here < column or (here == column and dashed and not dash)
        if not above and here > column:
            continue
        step = _step(line, above)
        if step is not None:
            kept.append(step)
        if above:
            column, dashed = here, dash
    return "\n".join(reversed(kept))


def _begin(lines: list[str]) -> int:
    """The line on which the value begins that the last line goes on with."""
    last = len(lines) - 1
    column, _ = _column(lines[last]) if lines[last].strip() else (len(lines[last]), False)
    for number in range(last - 1, -1, -1):
        line = lines[number]
        if line.strip() and _column(line)[0] < column:
            return number if _stays_open(line) else last
    return last


def _stays_open(line: str) -> bool:
    found = _LEAVES_OPEN.search(line)
    if found is None:
        return False
    value = found.group().removeprefix(":").strip()
    if value[0] in "\"'":
        return value.count(value[0]) % 2 == 1
    return value[0] in "|>" or any(value.count(o) > value.count(c) for c, o in _PAIRS.items())


def _column(line: str) -> tuple[int, bool]:
    """Where a line begins, and whether it begins an item of a list."""
    return len(line) - len(line.lstrip(" ")), line.lstrip(" ").startswith("-")


def _step(line: str, above: bool) -> str | None:
    """A line as the key or item that it begins; None if it begins none."""
    begin = line[: _column(line)[0]]
    body = line[len(begin) :]
    found = _HEAD.match(body)
    if found and above:
        return f"{begin}{found.group(1)}{found.group(2)}:"
    if body.startswith("-"):
        return f"{begin}-" if above else f"{begin}- 0"
    return f"{begin}{found.group(2)}: 0" if found else None


# Where in the structure of a file somebody is typing, though the line is not finished.
#
# The text up to the cursor, with a mark there and with what is open closed, is YAML more often than
# not; the place of the mark in it says which key or value is being written. If it is no YAML,
# because of an error above, the indentation of its lines says as much.


_MARK = "specc_cursor"
_BLOCK = re.compile(r"(?:^|[:\-?]\s+)[|>][+\-\d]*\s*(?:#.*)?$")
_TOKEN = re.compile(r"[\"'\[\]{}#]")
_CLOSING = {"[": "]", "{": "}"}
_ENDS = ("", "]", "}", "'", '"')


@dataclass(frozen=True, slots=True)
class TextCursor:
    """A key of the mapping at `route` or the value at it, and its text before the cursor."""

    route: Route
    is_key: bool
    before: str
    siblings: tuple[str, ...] = ()


def cursors(text: str, offset: int) -> list[TextCursor]:
    """What may be being written at an offset: a value, a key, or either of them."""
    head = text[:offset]
    found = _in_head(head, *_closing(head))
    if not found:
        head = outline(head)
        found = _in_head(head, *_closing(head))
    return found


def line_break(text: str) -> str:
    """The line break of a text: that of its first line."""
    found = LINE_BREAK.search(text)
    return found.group() if found else "\n"


def _in_head(head: str, closing: str, plausible: bool) -> list[TextCursor]:
    found: dict[TextCursor, None] = {}
    for ending in (closing, f": {closing}" if closing[:1] not in ("'", '"') else closing):
        if plausible:
            document = read_text("", f"{head}{_MARK}{ending}\n", ROW_KEYS)
            if document.source.spans is not None:
                found |= dict.fromkeys(_marked(document.source.spans))
    return list(found)


def _marked(top: TextNode) -> Iterator[TextCursor]:
    if top.scalar is not None and _MARK in top.scalar:
        yield TextCursor((), True, top.scalar.partition(_MARK)[0])
    for route, key, node in top.below():
        if key is not None and key.scalar and _MARK in key.scalar:
            parent = top.at(route[:-1]) or top
            others = [str(other) for other in parent.keys if other != route[-1]]
            yield TextCursor(route[:-1], True, key.scalar.partition(_MARK)[0], tuple(others))
        elif node.scalar is not None and _MARK in node.scalar:
            yield TextCursor(_spelled(route), False, node.scalar.partition(_MARK)[0])


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
    for line in SourceFile("", head).lines:
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


def outside(before: str) -> Iterator[tuple[int, str]]:
    """The characters of a text, from its end on, that are in no brackets which it closes."""
    closed: list[str] = []
    for at in range(len(before) - 1, -1, -1):
        char = before[at]
        if char in _OPENING:
            closed.append(_OPENING[char])
        elif not closed:
            yield at, char
        elif char == closed[-1]:
            closed.pop()


_OPENING = {")": "(", "]": "[", "}": "{"}


def _starts_token(before: str) -> bool:
    """Whether a value or key starts here: inside plain text, quotes and brackets are letters."""
    before = before.rstrip()
    return not before or before[-1] in ":-?[{,"
