"""Offsets into a text and positions of the protocol, whose columns count UTF-16 code units."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

from specc.source import SourceFile


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A line, counted from 0, and UTF-16 code units before the position in it."""

    line: int
    character: int


def position_at(source: SourceFile, offset: int) -> Position:
    """The position of a character of a text."""
    line = bisect_right(source.line_starts, offset) - 1
    before = source.text[source.line_starts[line] : offset]
    return Position(line, _units(before))


def offset_at(source: SourceFile, position: Position) -> int:
    """The character at a position; one beyond the text or its line is moved to the end of it."""
    if position.line >= len(source.line_starts):
        return len(source.text)
    start = source.line_starts[max(position.line, 0)]
    line = source.lines[max(position.line, 0)]
    if line.isascii():
        return start + min(max(position.character, 0), len(line))
    left = position.character
    for index, char in enumerate(line):
        if left < _units(char) or left <= 0:
            return start + index
        left -= _units(char)
    return start + len(line)


def _units(text: str) -> int:
    return len(text) if text.isascii() else len(text.encode("utf-16-le", "surrogatepass")) // 2
