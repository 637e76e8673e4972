"""Offsets into a text and positions of the protocol, whose columns count code units.

The protocol counts UTF-16 code units unless client and server agree on another encoding.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

from specc.source import SourceFile

_CODECS = {
    "utf-8": ("utf-8", 1),
    "utf-16": ("utf-16-le", 2),
    "utf-32": ("utf-32-le", 4),
}


@dataclass(frozen=True, slots=True, order=True)
class Position:
    """A line, counted from 0, and the code units before the position in it."""

    line: int
    character: int


@dataclass(frozen=True, slots=True)
class Columns:
    """Converts offsets and positions in the encoding that was agreed on."""

    encoding: str = "utf-16"

    def position_at(self, source: SourceFile, offset: int) -> Position:
        """The position of a character of a text."""
        line = bisect_right(source.line_starts, offset) - 1
        return Position(line, self._units(source.text[source.line_starts[line] : offset]))

    def offset_at(self, source: SourceFile, position: Position) -> int:
        """The character at a position; what is beyond the text or its line is its end."""
        if position.line >= len(source.line_starts):
            return len(source.text)
        start, line = source.line_starts[max(position.line, 0)], source.lines[max(position.line, 0)]
        if line.isascii():
            return start + min(max(position.character, 0), len(line))
        left = position.character
        for index, char in enumerate(line):
            left -= self._units(char)
            if left < 0:
                return start + index
        return start + len(line)

    def _units(self, text: str) -> int:
        codec, size = _CODECS.get(self.encoding, _CODECS["utf-16"])
        return len(text) if text.isascii() else len(text.encode(codec, "surrogatepass")) // size
