"""Where the cursor is in a text that may be unfinished."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.lang.builtins import FUNCTIONS
from specc.model.fsm import Generic
from specc.model.system import Operator
from specc.read import read_text
from specc.schema import ROW_KEYS
from specc.schema.places import role_of, split_at_part
from specc.source import LINE_BREAK, Route, SourceFile, TextNode

# The lines that the last line of a text lies in, known by their indentation alone.


_HEAD = re.compile(r"((?:- +)*)(\"[^\"]*\"|'[^']*'|[^\s\"'\[\]{}#:,&*!|>%@`][^:#]*?)\s*:(?=\s|$)")
_VALUE = re.compile(r"[:\-]\s+([|>][+\-\d]*\s*(?:#.*)?|[\[{\"'].*)$")
_CLOSING = {"[": "]", "{": "}"}


def enclosing_lines(head: str) -> str:
    """The last line with its enclosing keys and their siblings, found by indentation.

    They come without their values, so that errors elsewhere do not matter. A value that starts on
    an earlier line and is still open is kept.
    """
    lines = SourceFile("", head).lines
    at = _begin(lines)
    found = ["\n".join(lines[at:])]
    column, dashed = _column(lines[at])
    for line in reversed(lines[:at]):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        column_here, has_dash = _column(line)
        is_parent = column_here < column or (column_here == column and dashed and not has_dash)
        if not is_parent and column_here > column:
            continue
        step = _step(line, is_parent)
        if step is not None:
            found.append(step)
        if is_parent:
            column, dashed = column_here, has_dash
    return "\n".join(reversed(found))


def _begin(lines: list[str]) -> int:
    """The line on which the value begins that the last line goes on with."""
    last = len(lines) - 1
    column, _ = _column(lines[last]) if lines[last].strip() else (len(lines[last]), False)
    above = (number for number in range(last - 1, -1, -1) if lines[number].strip())
    number = next((number for number in above if _column(lines[number])[0] < column), last)
    found = _VALUE.search(lines[number])
    if found is None:
        return last
    value = found.group(1).strip()
    if value[0] in "\"'":
        is_open = value.count(value[0]) % 2 == 1
    else:
        pairs = (value.count(opening) > value.count(end) for opening, end in _CLOSING.items())
        is_open = value[0] in "|>" or any(pairs)
    return _begin(lines[: number + 1]) if is_open and number < last else last


def _column(line: str) -> tuple[int, bool]:
    """Where a line begins, and whether it begins an item of a list."""
    return len(line) - len(line.lstrip(" ")), line.lstrip(" ").startswith("-")


def _step(line: str, is_parent: bool) -> str | None:
    """A line as the key or item that it begins; None if it begins none."""
    begin = line[: _column(line)[0]]
    body = line[len(begin) :]
    found = _HEAD.match(body)
    if found and is_parent:
        return f"{begin}{found.group(1)}{found.group(2)}:"
    if body.startswith("-"):
        return f"{begin}-" if is_parent else f"{begin}- 0"
    return f"{begin}{found.group(2)}: 0" if found else None


# Where in the structure of a file somebody is typing, though the line is not finished.
#
# The lines that the last line lies in, with a mark at the cursor and with what is open closed, are
# YAML more often than not; the place of the mark says which key or value is being written.


_MARK = "specc_cursor"
_BLOCK = re.compile(r"(?:^|[:\-?]\s+)[|>][+\-\d]*\s*(?:#.*)?$")
_TOKEN = re.compile(r"[\"'\[\]{}#]")


@dataclass(frozen=True, slots=True)
class TextCursor:
    """A key of the mapping at `route` or the value at it, and its text before the cursor."""

    route: Route
    is_key: bool
    before: str
    siblings: tuple[str, ...] = ()
    sources: tuple[str, ...] = ()
    """The states and modes of the row of a transition table around it."""


def cursors(text: str, offset: int) -> list[TextCursor]:
    """What may be being written at an offset: a value, a key, or either of them."""
    head = enclosing_lines(text[:offset])
    closing = _closing(head)
    found: dict[TextCursor, None] = {}
    for ending in (closing, f": {closing}" if closing[:1] not in ("'", '"') else closing):
        document = read_text("", f"{head}{_MARK}{ending}\n", ROW_KEYS)
        if document.source.spans is not None:
            found |= dict.fromkeys(_cursors_at_mark(document.source.spans))
    return list(found)


def line_break(text: str) -> str:
    """The line break of a text: that of its first line."""
    found = LINE_BREAK.search(text)
    return found.group() if found else "\n"


def _cursors_at_mark(top: TextNode) -> Iterator[TextCursor]:
    if top.scalar is not None and _MARK in top.scalar:
        yield TextCursor((), True, top.scalar.partition(_MARK)[0])
    for route, key, node in top.below():
        if key is not None and key.scalar and _MARK in key.scalar:
            parent = top.at(route[:-1]) or top
            others = [str(other) for other in parent.keys if other != route[-1]]
            yield TextCursor(route[:-1], True, key.scalar.partition(_MARK)[0], tuple(others))
        elif node.scalar is not None and _MARK in node.scalar:
            # The mark may have become part of a key.
            route = tuple(s.partition(_MARK)[0] if isinstance(s, str) else s for s in route)
            before = node.scalar.partition(_MARK)[0]
            yield TextCursor(route, False, before, sources=tuple(_sources(top, route)))


def _sources(top: TextNode, route: Route) -> Iterator[str]:
    """The states and modes of the row that a cell at a route is in, if it is in one."""
    in_row = split_at_part(route)[1][:1] == ("transitions",)
    row = top.at(route[:-1]) if in_row else None
    first = (row.values.get("from") or row.values.get(0)) if row else None
    for item in (first, *first.values.values()) if first else ():
        if item.scalar:
            yield item.scalar


def _closing(head: str) -> str:
    """The quotes and brackets that close what a text leaves open."""
    stack: list[str] = []
    quote = ""
    block: int | None = None
    for line in SourceFile("", head).lines:
        indent = len(line) - len(line.lstrip())
        if block is None or (indent <= block and line.strip()):
            quote = _scan(line, stack, quote)
            block = indent if not quote and not stack and _BLOCK.search(line) else None
    return quote + "".join(_CLOSING[opened] for opened in reversed(stack))


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


def outside_brackets(before: str) -> Iterator[tuple[int, str]]:
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


# The call whose arguments are being written.


_NAME = re.compile(r"[^\W\d]\w*$")
_EXPRESSIONS = ("constant", "initial", "full", "argument")
_TEXT = re.compile(r"\"[^\"]*\"|'[^']*'")


@dataclass(frozen=True, slots=True)
class CallSignature:
    """How a call is written; `active` counts the argument at the cursor from 0."""

    label: str
    parameters: tuple[str, ...]
    words: str
    active: int


def signature(
    operators: Iterable[Operator], generics: Iterable[Generic], text: str, offset: int
) -> CallSignature | None:
    """The innermost call around an offset of a text, however unfinished the call is."""
    for cursor in cursors(text, offset):
        role = role_of(cursor.route)
        is_part = role is not None and role.kind in ("behaviour", "function")
        if role is not None and (is_part or role.form in _EXPRESSIONS):
            before = _TEXT.sub(lambda match: "_" * len(match.group()), cursor.before)
            if (found := _innermost_call(before)) is not None:
                own = _signature_of_part(generics, *found) if is_part else None
                return own or _signature(operators, *found)
    return None


def _signature_of_part(generics: Iterable[Generic], name: str, commas: int) -> CallSignature | None:
    """How a behaviour or function with parameters is called."""
    generic = next((each for each in generics if each.part.name == name), None)
    if generic is None:
        return None
    parameters = tuple(f"{p.name}: {p.type}" for p in generic.parameters)
    label = f"{name}({', '.join(parameters)})"
    return CallSignature(label, parameters, generic.part.title, min(commas, len(parameters) - 1))


def _innermost_call(before: str) -> tuple[str, int] | None:
    """The name in front of the innermost open bracket, and the commas behind it."""
    commas = 0
    for at, char in outside_brackets(before):
        if char == ",":
            commas += 1
        elif char in "([{":
            name = _NAME.search(before, 0, at)
            if char == "(" and name:
                return name.group(), commas
            commas = 0
    return None


def _signature(operators: Iterable[Operator], name: str, commas: int) -> CallSignature | None:
    operator = next((each for each in operators if each.name == name), None)
    function = FUNCTIONS.get(name)
    if operator is not None:
        parameters = tuple(f"{n}: {type_}" for n, type_ in operator.parameters)
        trace = f"({operator.trace})" if str(operator.trace) else ""
        result, words = str(operator.result), " ".join(filter(None, (operator.title, trace)))
    elif function and function.rule:
        listed, _, rest = function.signature.partition("-> ")
        result, _, words = rest.partition(": ")
        parameters = tuple(filter(None, listed.strip().split(", ")))
    else:
        return None
    label = f"{name}({', '.join(parameters)}) -> {result}"
    return CallSignature(label, parameters, words, min(commas, max(len(parameters) - 1, 0)))
