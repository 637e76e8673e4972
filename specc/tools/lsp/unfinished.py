"""Texts that are being typed: where earlier characters stand now, and names in unreadable texts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import accumulate

from specc.diagnostics import Diagnostic
from specc.read import Document, read_text
from specc.schema import ROW_KEYS, SpecFile, desugar, shape
from specc.source import Place, SourceFile

# Where the characters of an earlier text stand in the present one.
#
# While a line is being typed the file often is no YAML. Then the last analysis that understood it
# answers, and its offsets are carried over to the present text.


@dataclass(frozen=True, slots=True)
class Shift:
    """The parts that two texts have in common: old start, new start and length of each."""

    blocks: tuple[tuple[int, int, int], ...]

    def to_new(self, offset: int) -> int | None:
        """The offset in the present text; None if what was there has changed."""
        found = (
            new + offset - old for old, new, size in self.blocks if old <= offset <= old + size
        )
        return next(found, None)

    def to_old(self, offset: int) -> int | None:
        """The offset in the earlier text; None inside what has changed."""
        found = (
            old + offset - new for old, new, size in self.blocks if new <= offset <= new + size
        )
        return next(found, None)

    def changes(self) -> Iterator[tuple[slice, slice]]:
        """What lies between the common parts, in the old and in the new text."""
        for (old, new, size), (old_end, new_end, _) in zip(
            self.blocks, self.blocks[1:], strict=False
        ):
            yield slice(old + size, old_end), slice(new + size, new_end)


def shift(old: str, new: str) -> Shift:
    """Compare two texts by lines, and lines that differ by their beginnings and ends."""
    if old == new:
        return Shift(((0, 0, len(old)),))
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    old_starts = [*accumulate(map(len, before), initial=0)]
    new_starts = [*accumulate(map(len, after), initial=0)]
    blocks = [(0, 0, 0)]
    for first, last, there, there_end in _differing(before, after):
        start, end = old_starts[first], old_starts[last]
        new_start, new_end = new_starts[there], new_starts[there_end]
        parts = old[start:end], new[new_start:new_end]
        size = _common_start(*parts)
        ending = _common_start(*(part[size:][::-1] for part in parts))
        above, new_above, _ = blocks[-1]
        blocks[-1] = above, new_above, start + size - above
        blocks.append((end - ending, new_end - ending, ending))
    last_old, last_new, _ = blocks[-1]
    blocks[-1] = last_old, last_new, len(old) - last_old
    return Shift(tuple(blocks))


def _differing(before: list[str], after: list[str]) -> Iterator[tuple[int, int, int, int]]:
    """The lines that differ: from and to in the one text, from and to in the other."""
    first = _common_start(before, after)
    last = _common_start(before[first:][::-1], after[first:][::-1])
    old, new = before[first : len(before) - last], after[first : len(after) - last]
    if min(len(old), len(new)) < 2:
        yield first, first + len(old), first, first + len(new)
        return
    for tag, start, end, there, there_end in SequenceMatcher(None, old, new).get_opcodes():
        if tag != "equal":
            yield first + start, first + end, first + there, first + there_end


def _common_start(one: Sequence[str], other: Sequence[str]) -> int:
    """Length of the common beginning."""
    pairs = enumerate(zip(one, other, strict=False))
    return next((at for at, (a, b) in pairs if a != b), min(len(one), len(other)))


# A text that was never understood without its errors: their lines are overwritten by blanks.
#
# Every other character stays where it is, so what is known of that text holds for the present one.


_ROUNDS = 6
"""More errors than this are too many to say anything about the rest."""
_NOT_BREAK = re.compile(r"[^\r\n]")


def without_errors(document: Document) -> Document:
    """The document without the lines that are no YAML or lack their shape, as far as that goes."""
    for _ in range(_ROUNDS):
        if (error := _error(document)) is not None:
            document = _readable(document, error)
            continue
        data, wrong = desugar(document.data, document.source.path)
        wrong = wrong or shape(SpecFile, data, document.source.path)[1]
        if not wrong:
            break
        entries = [Place(found.primary.file, found.primary.route) for found in wrong]
        keys = [Place(entry.file, entry.route, "key") for entry in entries]
        document = _without(document, *map(document.source.offsets, (*entries, *keys)))
    return document


def _error(document: Document) -> Diagnostic | None:
    return next((d for d in document.diagnostics if d.severity == "error"), None)


def _readable(document: Document, error: Diagnostic) -> Document:
    """Blank the line without which most can be read: at the error, above, or where it begins."""
    source = document.source
    places = [*(related.place for related in error.related), error.primary]
    lines = [source.span(place).line for place in places]
    lines += [_line_above(source, line) for line in lines]
    starts = [source.line_starts[line - 1] for line in dict.fromkeys(lines)]

    def readable_until(candidate: Document) -> int:
        found = _error(candidate)
        return len(source.text) + 1 if found is None else found.primary.start or 0

    return max((_without(document, (start, start)) for start in starts), key=readable_until)


def _line_above(source: SourceFile, line: int) -> int:
    return next((above for above in range(line - 1, 0, -1) if source.line(above).strip()), line)


def _without(document: Document, *ranges: tuple[int, int]) -> Document:
    """The document with blanks in all lines that some ranges of its text touch."""
    source, text = document.source, document.source.text
    for start, end in ranges:
        touched = Place(source.path, (), "text", start, max(start, end - 1))
        span = source.span(touched)
        first, last = (
            source.line_starts[span.line - 1],
            (*source.line_starts, len(text))[span.end_line],
        )
        text = text[:first] + _NOT_BREAK.sub(" ", text[first:last]) + text[last:]
    return read_text(source.path, text, ROW_KEYS)
