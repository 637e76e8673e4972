"""Places in specification files: what a pass points at, and where that is in the text.

A pass names a `Place` by keys and indices; `Sources` turns it into a `Span` of lines and columns.
Nothing here knows YAML: the reader hands over a tree of `TextNode`s with character offsets.
"""

import os
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Literal

from specc.resources import is_library_part

ScalarStyle = Literal["", "'", '"', "|", ">"]
Route = tuple[str | int, ...]
"""Keys and indices from the top of a file down to a value."""

LINE_BREAK = re.compile(r"\r\n|\r|\n")

SET, STOP_WHEN, PUBLISH = "--set", "--stop-when", "--publish"
COMMAND_LINE = frozenset((SET, STOP_WHEN, PUBLISH))
"""What stands for a file where a text was given on the command line."""


@dataclass(frozen=True, slots=True)
class Place:
    """What a diagnostic points at.

    `part` chooses the value at `route` or the key that names it. `start` and `end` are character
    offsets inside the scalar as the program reads it (escapes resolved, lines folded). With part
    "text" the route is empty and the offsets count the characters of the whole file.
    """

    file: str
    route: Route = ()
    part: Literal["key", "value", "text"] = "value"
    start: int | None = None
    end: int | None = None

    def below(self, *keys: str | int) -> "Place":
        """The value at `keys` of this, or the nearest thing around it that the file has."""
        return replace(self, route=(*self.route, *keys), part="value")

    def within(self, start: int, end: int) -> "Place":
        """A part of this scalar."""
        return replace(self, start=start, end=end)

    def contains(self, other: "Place") -> bool:
        """Whether another place is this value, or stands in it."""
        return self.file == other.file and other.route[: len(self.route)] == self.route


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of a file; lines and columns count characters from 1, the end is exclusive."""

    file: str
    line: int
    col: int
    end_line: int
    end_col: int


@dataclass(eq=False, slots=True)
class TextNode:
    """A value in the text: its offsets and, for a mapping or a list, its parts."""

    start: int
    end: int
    scalar: str | None = None
    style: ScalarStyle = ""
    keys: dict[str | int, "TextNode"] = field(default_factory=dict)
    values: dict[str | int, "TextNode"] = field(default_factory=dict)

    def at(self, route: Route) -> "TextNode | None":
        """The value at a route from here, if there is one."""
        node: TextNode | None = self
        for step in route:
            node = node.values.get(step) if node else None
        return node

    def below(self, route: Route = ()) -> "Iterator[tuple[Route, TextNode | None, TextNode]]":
        """Every value below: its route, the key that names it, and the value itself."""
        for step, value in self.values.items():
            here = (*route, step)
            yield here, self.keys.get(step), value
            yield from value.below(here)


@dataclass(frozen=True)
class SourceFile:
    """A file as it was read; `spans` is None when it has no tree of values.

    Short forms keep their places: a route that goes on below a scalar means the scalar
    (`T_d: Motors` for `T_d: {type: Motors}`), and where a list stands for a mapping, as in the
    rows of a table, `row_keys` gives the keys that its items stand for.
    """

    path: str
    text: str
    spans: TextNode | None = None
    row_keys: tuple[str, ...] = ()

    @cached_property
    def line_starts(self) -> list[int]:
        """Offset of the first character of every line."""
        return [0, *(match.end() for match in LINE_BREAK.finditer(self.text))]

    @cached_property
    def lines(self) -> list[str]:
        """Text of every line without its line break."""
        return LINE_BREAK.split(self.text)

    @cached_property
    def next_with_content(self) -> list[int]:
        """Number of the first line from each on that is neither empty nor a comment; else the last.

        The first entry is for line 1, the last for the end.
        """
        after = len(self.lines)
        found = [after]
        for number in range(len(self.lines), 0, -1):
            text = self.lines[number - 1].strip()
            if text and not text.startswith("#"):
                after = number
            found.append(after)
        return found[::-1]

    def node(self, route: Route) -> TextNode | None:
        """The value at a route as it is written, if there is one."""
        return self.spans.at(route) if self.spans else None

    @property
    def nodes(self) -> Iterator[tuple[Route, TextNode | None, TextNode]]:
        """Every value: its route, the key that names it, and the value itself."""
        return self.spans.below() if self.spans else iter(())

    def line(self, number: int) -> str:
        """Text of a line, counted from 1, without its line break; empty beyond the file."""
        return self.lines[number - 1] if 1 <= number <= len(self.lines) else ""

    def span(self, place: Place) -> Span:
        """Where a place is; the nearest existing parent stands in for a route that is not there."""
        start, end = self.offsets(place)
        return Span(self.path, *self._position(start), *self._position(max(start, end)))

    def written(self, route: Route) -> str:
        """The characters of a value exactly as the file has them (a number's own digits)."""
        node, found = self._descend(route)
        return self.text[node.start : node.end] if node is not None and found else ""

    def scalar(self, place: Place) -> str | None:
        """What stands at a place as the program reads it; None if nothing stands just there."""
        node, found = self._descend(place.route, key=place.part == "key")
        return node.scalar if node is not None and found else None

    def offsets(self, place: Place) -> tuple[int, int]:
        """First character of a place in the text and the one after its last."""
        if place.part == "text":
            start = place.start or 0
            return start, start if place.end is None else place.end
        node, found = self._descend(place.route, key=place.part == "key")
        if node is None:
            return 0, 0
        if not found or place.start is None or node.scalar is None:
            return node.start, node.end
        offsets = raw_offsets(node.scalar, self.text[node.start : node.end], node.style)
        length = len(node.scalar)
        first = min(max(place.start, 0), length)
        last = min(max(length if place.end is None else place.end, first), length)
        return node.start + offsets[first], node.start + offsets[last]

    def _descend(self, route: Route, key: bool = False) -> tuple[TextNode | None, bool]:
        """Node at a route and whether the whole route exists; else the key of its last parent."""
        node, name = self.spans, None
        for step in route:
            if node is None:
                break
            if node.scalar is not None:
                return node, True
            row = self.row_keys.index(step) if step in self.row_keys else -1
            below = node.values.get(step) or node.values.get(row)
            if below is None:
                return name or node, False
            name, node = node.keys.get(step), below
        return (name or node if key else node), True

    def _position(self, offset: int) -> tuple[int, int]:
        line = bisect_right(self.line_starts, offset)
        return line, offset - self.line_starts[line - 1] + 1


def on_command_line(values: Mapping[str, str]) -> SourceFile:
    """Values given by name on the command line, as a file with a line `name=value` for each."""
    top, text = TextNode(0, 0), ""
    for name, value in values.items():
        begin = len(text) + len(name) + 1
        top.keys[name] = TextNode(len(text), begin - 1, name)
        top.values[name] = TextNode(begin, begin + len(value), value)
        text += f"{name}={value}\n"
    return SourceFile(SET, text, top)


def beside(path: str, named: str) -> str:
    """The path of a file that the one at `path` names: beside it, or a part of the library."""
    if is_library_part(named):
        return named
    return os.path.normpath(os.path.join(os.path.dirname(path), named))


def relative_path(path: str, folder: str) -> str:
    """A path as it is seen from a folder, alike on all machines."""
    if is_library_part(path):
        return path
    return os.path.relpath(path, folder).replace(os.sep, "/")


def real_path(path: str) -> str:
    """One name for all spellings of a path."""
    if is_library_part(path):
        return path
    try:
        return os.path.realpath(path)
    except (OSError, ValueError):  # no file can have this name, which reading it will report
        return path


class Sources:
    """All files that were read for a specification."""

    def __init__(self, files: Iterable[SourceFile] = ()) -> None:
        self._files = {source.path: source for source in files}

    def add(self, source: SourceFile) -> None:
        """Take in a file that was read later."""
        self._files[source.path] = source

    def __iter__(self) -> Iterator[SourceFile]:
        """The files, in the order in which they were read."""
        return iter(self._files.values())

    def get(self, path: str) -> SourceFile | None:
        """The file of a path, if it was read."""
        return self._files.get(path)

    def span(self, place: Place) -> Span:
        """Where a place is; the head of the file if the file was never read."""
        source = self._files.get(place.file)
        return source.span(place) if source is not None else Span(place.file, 1, 1, 1, 1)

    def line(self, file: str, number: int) -> str:
        """Text of a line of a file, counted from 1; empty if there is none."""
        source = self._files.get(file)
        return source.line(number) if source is not None else ""


# From the characters of a scalar's value back to the characters that a file spells it with.
#
# YAML folds lines, strips indentation and resolves escapes. Diagnostics inside an expression count
# characters of the value, an editor counts characters of the file; this is the bridge.


_ESCAPE = re.compile(r"\\(?:x.{2}|u.{4}|U.{8}|.)", re.DOTALL)
_JOINED_LINES = re.compile(r"\\(?:\r\n|\r|\n)[ \t]*")
_RUN = re.compile(r".{1,64}", re.DOTALL)
"""Characters that a file probably spells as they are."""
_MARKS = re.compile(r"[\\'\"]")
_BLOCK_HEADER = re.compile(r"[|>][^\r\n]*(?:\r\n|\r|\n)")


@lru_cache(8)
def raw_offsets(value: str, raw: str, style: ScalarStyle) -> tuple[int, ...]:
    """Offset in `raw` of every character of `value`, and of its end.

    Exact wherever a character of the value is spelled in the file; white space that stands for line
    breaks is placed where its first character is written.
    """
    header = _BLOCK_HEADER.match(raw) if style in ("|", ">") else None
    position = header.end() if header else int(style in ("'", '"'))
    offsets: list[int] = []
    for run in _RUN.findall(value):
        if raw.startswith(run, position) and not _MARKS.search(run):
            offsets += range(position, position + len(run))
            position += len(run)
            continue
        for char in run:
            position = _find(char, raw, position, style)
            offsets.append(min(position, len(raw)))
            position += _width(raw, position, style)
    return (*offsets, min(position, len(raw)))


def _find(char: str, raw: str, position: int, style: ScalarStyle) -> int:
    """Where the next character of the value is written, from `position` on."""
    if style == '"':
        while joined := _JOINED_LINES.match(raw, position):
            position = joined.end()
        if raw.startswith("\\", position):
            return position
    if char.isspace():
        return position
    while position < len(raw) and raw[position] != char and raw[position].isspace():
        position += 1
    return position


def _width(raw: str, position: int, style: ScalarStyle) -> int:
    """Number of characters that the file spends on the character of the value at `position`."""
    if style == '"' and (escape := _ESCAPE.match(raw, position)):
        return len(escape.group())
    if style == "'" and raw.startswith("''", position):
        return 2
    return 1
