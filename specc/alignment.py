"""From the characters of a scalar's value back to the characters that a file spells it with.

YAML folds lines, strips indentation and resolves escapes. Diagnostics inside an expression count
characters of the value, an editor counts characters of the file; this is the bridge.
"""

import re
from functools import lru_cache
from typing import Literal

ScalarStyle = Literal["", "'", '"', "|", ">"]

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
    position = _opening(raw, style)
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


def _opening(raw: str, style: ScalarStyle) -> int:
    if style in ("'", '"'):
        return 1
    header = _BLOCK_HEADER.match(raw) if style in ("|", ">") else None
    return header.end() if header else 0


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
