"""The line of a file around a spot, cut to a readable width, and the columns to underline."""

from dataclasses import dataclass
from itertools import accumulate

from specc.diagnostics.render.visible import visible, width
from specc.source import Span

MAX_COLUMNS = 100
_CUT = "..."
# What lies further from the start of a span cannot be shown; a file may be one line of megabytes.
_NEAR = 4 * MAX_COLUMNS


@dataclass(frozen=True, slots=True)
class Excerpt:
    """Text of a line as shown, and where and how far to underline it, in terminal columns."""

    text: str
    indent: int
    length: int


def excerpt(line: str, span: Span, columns: int = MAX_COLUMNS) -> Excerpt:
    """The part of `line`, the first line of `span`, that has the start of the span in it.

    It takes at most as many terminal columns.
    """
    start = min(span.col - 1, len(line))
    end = span.end_col - 1 if span.end_line == span.line else len(line.rstrip())
    end = min(max(end, start), len(line))
    parts = (
        line[max(start - _NEAR, 0) : start],
        line[start : min(end, start + _NEAR)],
        line[end : end + _NEAR],
    )
    head, middle, tail = map(visible, parts)
    before, marked, after = _windowed(head, middle, tail, columns)
    return Excerpt(before + marked + after, width(before), max(width(marked), 1))


def _windowed(before: str, marked: str, after: str, columns: int) -> tuple[str, str, str]:
    """The three parts of a line, shortened where they are far from the start of the mark."""
    if width(before) + width(marked) + width(after) <= columns:
        return before, marked, after
    if width(marked) > columns // 2:
        marked, after = _head(marked, columns // 2), ""
    before = _tail(before, columns - width(marked) - min(width(after), columns // 4))
    return before, marked, _head(after, columns - width(before) - width(marked))


def _head(text: str, columns: int) -> str:
    if width(text) <= columns:
        return text
    fitting = sum(taken <= columns - len(_CUT) for taken in accumulate(map(width, text)))
    return text[:fitting] + _CUT


def _tail(text: str, columns: int) -> str:
    return _head(text[::-1], columns)[::-1]
