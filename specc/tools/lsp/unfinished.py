"""Texts that are being typed: made readable, with places moved along, and what is surely wrong."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from specc.diagnostics import Diagnostic, Edit
from specc.read import Document, read_text
from specc.schema import ROW_KEYS, SpecFile, desugar, shape
from specc.source import Place, SourceFile, Sources

# Where a text of a moment ago stands in the present one.
#
# While a line is being typed the file often is no YAML. Then the last text that could be understood
# answers, and offsets are carried over the one stretch that changed. A mended text has blanks where
# there are errors, and everything else in its place (`specc.tools.lsp.unfinished`).


@dataclass(frozen=True, slots=True)
class Shift:
    """The stretch in which two texts differ: `old_end` and `new_end` are behind it."""

    start: int
    old_end: int
    new_end: int

    @property
    def size(self) -> int:
        """Characters that the longer of the two stretches has."""
        return max(self.old_end, self.new_end) - self.start

    def to_new(self, offset: int) -> int | None:
        """The offset in the present text; None if what was there has changed."""
        return _moved(offset, self.start, self.old_end, self.new_end)

    def to_old(self, offset: int) -> int | None:
        """The offset in the earlier text; None inside what has changed."""
        return _moved(offset, self.start, self.new_end, self.old_end)


def shift(old: str, new: str) -> Shift:
    """Where the characters of an earlier or mended text stand in the present one."""
    if len(old) == len(new) and (old == new or _blanked(old, new)):
        return Shift(len(old), len(old), len(new))
    return difference(old, new)


def difference(old: str, new: str) -> Shift:
    """What lies between the common beginning and the common end of two texts."""
    start = _common(old, new)
    rest = min(len(old), len(new)) - start
    ending = _common(old[len(old) - rest :][::-1], new[len(new) - rest :][::-1])
    return Shift(start, len(old) - ending, len(new) - ending)


def _blanked(old: str, new: str) -> bool:
    """Whether the texts differ only in characters that are blank in the old one."""
    return all(a == b or a == " " for a, b in zip(old, new, strict=True))


def _common(a: str, b: str) -> int:
    """Length of the common beginning, found by halving: comparing slices is fast."""
    low, high = 0, min(len(a), len(b))
    while low < high:
        middle = (low + high + 1) // 2
        if a[low:middle] == b[low:middle]:
            low = middle
        else:
            high = middle - 1
    return low


def _moved(offset: int, start: int, end: int, other_end: int) -> int | None:
    if offset <= start:
        return offset
    return offset - end + other_end if offset >= end else None


# A text with errors without them: what cannot be understood is overwritten by blanks.
#
# Every other character stays where it is, so what is known of the mended text holds for the text.


ROUNDS = 6
"""More errors than this are too many to say anything about the rest."""
_CLOSE = 30
"""Lines between a quote that opens and the next one, which was meant to open."""
_KEY = re.compile(r"\s*[\w.]+:(?=\s+[^\s#])")
_DASH_BEFORE = re.compile(r"-\s+$")
_NOT_BREAK = re.compile(r"[^\r\n]")
_COMMA_BEHIND = re.compile(r"\s*,")
_COMMA_BEFORE = re.compile(r",\s*$")


def mended(document: Document) -> Document | None:
    """A document without what is not YAML or has not its shape; None if that leaves nothing."""
    for _ in range(ROUNDS):
        if not document.ok:
            better = _readable(document)
        else:
            data, wrong = desugar(document.data, document.source.path)
            wrong = wrong or shape(SpecFile, data, document.source.path)[1]
            if not wrong:
                return document
            better = _shaped(document, wrong)
        if better is None or better.source.text == document.source.text:
            return None
        document = better
    return None


def _readable(document: Document) -> Document | None:
    """The document without one line that the reader complains of, or of which it notices later."""
    wrong = next(d for d in document.diagnostics if d.severity == "error")
    if wrong.primary.part != "text":
        return None
    best, furthest = None, -1
    for line in _suspects(document, wrong):
        candidate = _without(document, line)
        error = next((d for d in candidate.diagnostics if d.severity == "error"), None)
        if error is None:
            return candidate
        at = error.primary.start or 0
        if error.primary.part == "text" and at > furthest:
            best, furthest = candidate, at
    return best


def _suspects(document: Document, wrong: Diagnostic) -> Iterator[tuple[int, int]]:
    """Lines where quotes open, at the error, where its construct begins.

    Of a key with lines that belong to it the value comes first; one with nothing is seldom right.
    """
    source = document.source
    places = [wrong.primary, *(related.place for related in wrong.related)]
    # A quote or bracket that is never closed is noticed far below.
    places.sort(key=lambda place: source.text[place.start or 0 :][:1] not in tuple("\"'[{"))
    lines = [source.span(place).line for place in places]
    above = (next((n for n in range(at - 1, 0, -1) if source.line(n).strip()), at) for at in lines)
    around = [number for pair in zip(lines, above, strict=True) for number in pair]
    for number in dict.fromkeys((*_quoting(source, source.span(wrong.primary).line), *around)):
        start, line = source.line_starts[number - 1], source.line(number)
        if (key := _KEY.match(line)) and _is_above_more(source, number):
            yield start + key.end(), start + len(line)
        if line.strip():
            yield start, start + len(line)


def _is_above_more(source: SourceFile, number: int) -> bool:
    """Whether the next line with content stands further in, or is an item of its list."""
    line, more = source.line(number), source.line(source.next_with_content[number])
    deeper = (len(more) - len(more.lstrip())) - (len(line) - len(line.lstrip()))
    return deeper > 0 or (not deeper and more.lstrip().startswith("- "))


def _quoting(source: SourceFile, at: int) -> list[int]:
    """The lines close above an error with a quote that opens or closes in another one."""
    odd = [n for n in range(at, max(at - _CLOSE, 0), -1) if source.line(n).count('"') % 2]
    return odd[1::-1]


def _shaped(document: Document, wrong: list[Diagnostic]) -> Document:
    """The document without the entries of which the schema complains."""
    entries = (_entry(document, found.primary) for found in wrong if found.primary.route)
    return _without(document, *entries)


def _entry(document: Document, place: Place) -> tuple[int, int]:
    """From the key of a value to its end, with one of the commas beside it."""
    source = document.source
    key = source.offsets(Place(place.file, place.route, "key"))
    value = source.offsets(Place(place.file, place.route))
    start, end = min(key[0], value[0]), max(key[1], value[1])
    if dash := _DASH_BEFORE.search(source.text, max(0, start - 80), start):
        return dash.start(), end
    if behind := _COMMA_BEHIND.match(source.text, end):
        return start, behind.end()
    before = _COMMA_BEFORE.search(source.text, max(0, start - 200), start)
    return (before.start() if before else start), end


def _without(document: Document, *stretches: tuple[int, int]) -> Document:
    """The document with stretches of its text overwritten."""
    text = document.source.text
    for start, end in stretches:
        text = text[:start] + _NOT_BREAK.sub(" ", text[start:end]) + text[end:]
    return read_text(document.source.path, text, ROW_KEYS)


# What is certainly wrong in a text with errors that keep it from being read as a whole.
#
# It is found in the mended text. What only follows from the missing parts is not reported, since it
# would go away with the error.


_OF_TEXTS = ("E02", "E03", "O02")
"""Names and types: wrong whatever the missing parts say, unless these declare the name."""
_WORD = re.compile(r"\w+")
_DEFINED = re.compile(r"[\w.]+(?=[\"']?\s*:)|(?m:^[ -]*[\w.]+)|enum\[[^\]\n]*")
_KEYS = frozenset(("enum", "is", "type", "when", "title", "init", "error", "terminal"))
"""Words of the language that messages use as well."""


def certain(
    found: Iterable[Diagnostic],
    mended: Sources,
    present: Sources,
    earlier: Iterable[Diagnostic],
) -> Iterator[Diagnostic]:
    """Findings of mended texts that also hold of the present texts, at offsets in these.

    Findings of an earlier analysis of the whole text are repeated.
    """
    known = {(diagnostic.code, diagnostic.message) for diagnostic in earlier}
    missing = {word for source in mended for word in _missing(source.text, present, source.path)}
    for diagnostic in found:
        names = set(_WORD.findall(diagnostic.message))
        of_text = diagnostic.code.startswith(_OF_TEXTS) and not names & missing
        if of_text or (diagnostic.code, diagnostic.message) in known:
            yield _by_offsets(diagnostic, mended)


def _missing(mended: str, present: Sources, path: str) -> Iterator[str]:
    """The names that a text defines where it was overwritten: keys, what begins a line, members."""
    source = present.get(path)
    if source is None or source.text == mended or len(source.text) != len(mended):
        return
    changed, text = difference(mended, source.text), source.text
    begin = text.rfind("\n", 0, changed.start) + 1
    for name in _DEFINED.finditer(text, begin):
        if name.start() >= changed.new_end:
            return
        if mended[name.end() - 1] == " ":
            yield from (word for word in _WORD.findall(name.group()) if word not in _KEYS)


def _by_offsets(diagnostic: Diagnostic, sources: Sources) -> Diagnostic:
    """A diagnostic whose places hold without the tree of the mended text."""

    def fixed(place: Place) -> Place:
        source = sources.get(place.file)
        return Place(place.file, (), "text", *source.offsets(place)) if source else place

    fix = diagnostic.fix
    return replace(
        diagnostic,
        primary=fixed(diagnostic.primary),
        related=tuple(replace(r, place=fixed(r.place)) for r in diagnostic.related),
        fix=fix and replace(fix, edits=tuple(Edit(fixed(e.place), e.text) for e in fix.edits)),
    )
