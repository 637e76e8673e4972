"""The comments of a YAML text: what follows a `#` that stands outside all scalars."""

import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.reachable import reachable
from specc.source import SourceFile, TextNode

_MARK = re.compile(r"(?:^|(?<=[ \t]))#[^\r\n]*", re.MULTILINE)
_LINE_END = re.compile(r"\r|\n|$")


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment with its `#`, by offsets into the text.

    `alone` says that nothing but white space stands before it on its line.
    """

    start: int
    end: int
    text: str
    is_whole_line: bool


def comments_of(source: SourceFile) -> list[Comment]:
    """The comments of a file that was understood, in order; none of any other."""
    return [] if source.spans is None else comments_in(source.text, _scalars(source.spans))


def comments_in(text: str, scalars: Iterable[tuple[int, int]]) -> list[Comment]:
    """The comments of a text whose scalars stand at these offsets."""
    spans = sorted((_content(text, start, end), end) for start, end in scalars)
    starts = [start for start, _ in spans]
    found = []
    mark = _MARK.search(text)
    while mark is not None:
        before = bisect_right(starts, mark.start()) - 1
        end = mark.end()
        if before >= 0 and mark.start() < spans[before][1]:
            end = spans[before][1]
        else:
            alone = _is_alone(text, mark.start())
            found.append(Comment(mark.start(), end, mark[0].rstrip(), alone))
        mark = _MARK.search(text, end)
    return found


def _content(text: str, start: int, end: int) -> int:
    """Where a scalar begins; the header of a block scalar may still be followed by a comment."""
    if text[start:end][:1] not in ("|", ">"):
        return start
    line_end = _LINE_END.search(text, start)
    return min(line_end.start() if line_end else start, end)


def _is_alone(text: str, offset: int) -> bool:
    while offset > 0 and text[offset - 1] in " \t":
        offset -= 1
    return offset == 0 or text[offset - 1] in "\r\n"


def _scalars(top: TextNode) -> Iterator[tuple[int, int]]:
    # What an alias stands for is the same node again.
    for part in reachable([top], lambda node: (*node.keys.values(), *node.values.values())):
        if part.scalar is not None:
            yield part.start, part.end
