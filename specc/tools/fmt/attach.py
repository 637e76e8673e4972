"""Which entry a comment belongs to, and which entry an empty line precedes."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

from specc.read.comments import Comment
from specc.source import SourceFile
from specc.tools.fmt.tree import Collection, Entry

_NO_TEXT = re.compile(r"[\s-]*")
_BLANKS = re.compile(r"\s*")


@dataclass(eq=False, slots=True)
class _EntryPlace:
    """An entry with the collections that it is in, outermost first, and its column."""

    entry: Entry
    within: tuple[Collection, ...]
    column: int


class Attacher:
    """Puts comments and empty lines into the tree of a text."""

    def __init__(self, text: str, root: Collection) -> None:
        self._text = text
        self._root = root
        self._places: list[_EntryPlace] = []
        self._lines = SourceFile("", text).line_starts

    def attach(self, comments: list[Comment]) -> None:
        """Every comment goes to one entry or to the end of one collection."""
        for comment in comments:
            _break(self._root, comment.start)
        self._places = list(self._walk(self._root, ()))
        starts = [place.entry.start for place in self._places]
        pending: dict[int, list[str]] = {}
        for comment in comments:
            following = bisect_right(starts, comment.start)
            if comment.is_whole_line or self._follows_dash(comment):
                self._alone(comment, following, pending)
            else:
                self._beside(comment, following, pending)
        for number, place in enumerate(self._places):
            place.entry.above[:0] = pending.get(number, [])
            if self._blank_before(place.entry.start):
                place.entry.above.append("")
        for place in self._places:
            place.entry.above[:] = _tidy(place.entry.above)

    def _walk(self, whole: Collection, above: tuple[Collection, ...]) -> Iterator[_EntryPlace]:
        """Entries that get a line of their own."""
        within = (*above, whole)
        for entry in whole.entries:
            yield _EntryPlace(
                entry, within, self._column(whole.start if not whole.flow else entry.start)
            )
            if isinstance(entry.value, Collection) and (entry.value.broken or not entry.value.flow):
                yield from self._walk(entry.value, within)

    def _alone(self, comment: Comment, following: int, pending: dict[int, list[str]]) -> None:
        lines = ["", comment.text] if self._blank_before(comment.start) else [comment.text]
        closed = self._closed_by(comment, following)
        if closed is not None:
            closed.below += lines
        else:
            pending.setdefault(following, []).extend(lines)

    def _closed_by(self, comment: Comment, following: int) -> Collection | None:
        """The collection at whose end a comment stands; None if it is about what follows."""
        if following == 0:
            return None
        column = self._column(comment.start)
        after = self._places[following] if following < len(self._places) else None
        open_after = after.within if after else ()
        before = self._places[following - 1]
        own = before.entry.value
        inside = before.within
        if isinstance(own, Collection) and (own.broken or not own.flow):
            inside = (*inside, own)
        ended = [whole for whole in inside if whole not in open_after]
        for whole in reversed(ended):
            if whole.flow and whole.start < comment.start < whole.end:
                return whole
        limit = after.column if after else -1
        for whole in reversed(ended):
            if not whole.flow and limit < self._column(whole.start) <= column:
                return whole
        return None if after else self._root

    def _beside(self, comment: Comment, following: int, pending: dict[int, list[str]]) -> None:
        if following == 0:
            pending.setdefault(0, []).append(comment.text)
            return
        entry = self._places[following - 1].entry
        if entry.beside:
            entry.beside += f" {comment.text}"
        else:
            entry.beside = comment.text

    def _follows_dash(self, comment: Comment) -> bool:
        start = self._line_start(comment.start)
        return start < comment.start and self._is_empty(start, comment.start)

    def _blank_before(self, offset: int) -> bool:
        """Whether the line above the one that an entry or comment begins is empty."""
        line = self._line_start(offset)
        if line == 0 or not self._is_empty(line, offset):
            return False
        end = line - (2 if self._text[line - 2 : line] == "\r\n" else 1)
        start = self._line_start(end)
        return _BLANKS.fullmatch(self._text, start, end) is not None

    def _is_empty(self, start: int, end: int) -> bool:
        """Whether nothing but blanks and the dashes of lists stands there."""
        return _NO_TEXT.fullmatch(self._text, start, end) is not None

    def _line_start(self, offset: int) -> int:
        return self._lines[bisect_right(self._lines, offset) - 1]

    def _column(self, offset: int) -> int:
        return offset - self._line_start(offset)


def _break(whole: Collection, offset: int) -> None:
    """Mark the flow collections that a comment at an offset stands in, unless they are empty."""
    if whole.flow and whole.entries and whole.start < offset < whole.end:
        whole.broken = True
    inside = bisect_right(whole.entries, offset, key=lambda entry: entry.start) - 1
    value = whole.entries[inside].value if inside >= 0 else None
    if isinstance(value, Collection):
        _break(value, offset)


def _tidy(lines: list[str]) -> list[str]:
    """At most one empty line in a row."""
    return [line for number, line in enumerate(lines) if line or number == 0 or lines[number - 1]]
