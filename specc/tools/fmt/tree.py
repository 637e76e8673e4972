"""A YAML text as a tree that a printer can lay out anew: values, styles, anchors and comments."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field

from specc.read.compose import NumberRangeError, is_null, plain_value
from specc.read.document import Comment
from specc.read.syntax import (
    AliasEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    events,
)
from specc.source import SourceFile

_BLANK = re.compile(r"(?:\s+(?:#[^\r\n]*)?)*")
"""White space and the comments in it."""


@dataclass(eq=False, slots=True)
class Scalar:
    """A scalar: its value, its style and its characters in the text.

    As in every value, `begin` is the offset of the anchor if there is one, `start` that of the
    value itself.
    """

    text: str
    style: str
    raw: str
    begin: int
    start: int
    end: int
    anchor: str = ""


@dataclass(eq=False, slots=True)
class Alias:
    """`*name`."""

    name: str
    begin: int
    start: int
    end: int
    anchor: str = ""


@dataclass(eq=False, slots=True)
class Entry:
    """An entry of a mapping or list, with the comments that belong to it.

    `above` are lines before it, comments or empty; `beside` stands at the end of its line.
    """

    key: Scalar | None
    value: YamlValue
    above: list[str] = field(default_factory=list)
    beside: str = ""

    @property
    def name(self) -> str:
        """Its key; empty in a list."""
        return self.key.text if self.key else ""

    @property
    def start(self) -> int:
        """Offset of its first character."""
        return self.value.begin if self.key is None else self.key.begin


@dataclass(eq=False, slots=True)
class Collection:
    """A mapping or a list.

    `flow`: written in braces or brackets. `broken`: it has an inner comment and can only be
    printed over several lines. `below` are lines behind its last entry, comments or empty.
    """

    is_mapping: bool
    flow: bool
    begin: int
    start: int
    end: int
    anchor: str = ""
    entries: list[Entry] = field(default_factory=list)
    below: list[str] = field(default_factory=list)
    broken: bool = False

    @property
    def is_block(self) -> bool:
        """Whether its entries get lines of their own."""
        return self.broken or not self.flow

    @property
    def has_links(self) -> bool:
        """Whether something below has an anchor or is an alias, so that order matters."""
        return any(
            entry.value.anchor
            or isinstance(entry.value, Alias)
            or (isinstance(entry.value, Collection) and entry.value.has_links)
            for entry in self.entries
        )


YamlValue = Scalar | Alias | Collection


def parse(text: str) -> tuple[YamlValue, list[Scalar]]:
    """The tree of a text that is one YAML document without faults, and all its scalars."""
    scalars: list[Scalar] = []
    stream = events(text)
    for event in stream:
        value = _value(event, stream, text, scalars)
        if value is not None:
            return value, scalars
    raise ValueError("the text has no value")


def _value(
    event: Event, stream: Iterator[Event], text: str, scalars: list[Scalar]
) -> YamlValue | None:
    begin, end = event.start_mark.index, event.end_mark.index
    if isinstance(event, AliasEvent):
        return Alias(event.anchor, begin, begin, end)
    if not isinstance(event, (ScalarEvent, MappingStartEvent, SequenceStartEvent)):
        return None
    anchor = event.anchor or ""
    start = begin
    if anchor and (blank := _BLANK.match(text, begin + 1 + len(anchor))):
        start = blank.end()
    if isinstance(event, ScalarEvent):
        start = min(start, end)
        raw = text[start:end]
        scalar = Scalar(event.value, event.style or "", raw, begin, start, end, anchor)
        scalars.append(scalar)
        return scalar
    is_mapping = isinstance(event, MappingStartEvent)
    collection = Collection(is_mapping, bool(event.flow_style), begin, start, end, anchor)
    for inner in stream:
        if isinstance(inner, (MappingEndEvent, SequenceEndEvent)):
            collection.end = inner.end_mark.index
            break
        value = _value(inner, stream, text, scalars)
        key = None
        if is_mapping:
            assert isinstance(value, Scalar)
            key, value = value, _value(next(stream), stream, text, scalars)
        assert value is not None
        collection.entries.append(Entry(key, value))
    return collection


# Which entry a comment belongs to, and which entry an empty line precedes.


@dataclass(eq=False, slots=True)
class _EntryPlace:
    """An entry with the collections that it is in, outermost first, and its column."""

    entry: Entry
    within: tuple[Collection, ...]
    column: int


def attach_comments(text: str, root: Collection, comments: list[Comment]) -> None:
    """Put each comment and empty line to an entry, or to the end of a collection."""
    _Attacher(text, root).attach(comments)


class _Attacher:
    def __init__(self, text: str, root: Collection) -> None:
        self._text = text
        self._root = root
        self._places: list[_EntryPlace] = []
        self._lines = SourceFile("", text).line_starts

    def attach(self, comments: list[Comment]) -> None:
        for comment in comments:
            _mark_broken(self._root, comment.start)
        self._places = list(self._walk(self._root, ()))
        starts = [place.entry.start for place in self._places]
        pending: dict[int, list[str]] = {}
        for comment in comments:
            following = bisect_right(starts, comment.start)
            line = self._line_start(comment.start)
            # Nothing but blanks and the dashes of lists stands before it.
            is_after_dash = line < comment.start and self._is_empty(line, comment.start)
            if comment.is_whole_line or is_after_dash:
                lines = ["", comment.text] if self._blank_before(comment.start) else [comment.text]
                collection = self._closed_by(comment, following)
                if collection is not None:
                    collection.below += lines
                else:
                    pending.setdefault(following, []).extend(lines)
            elif following == 0:
                pending.setdefault(0, []).append(comment.text)
            else:
                entry = self._places[following - 1].entry
                entry.beside += f" {comment.text}" if entry.beside else comment.text
        for number, place in enumerate(self._places):
            above = [*pending.get(number, []), *place.entry.above]
            if self._blank_before(place.entry.start):
                above.append("")
            # At most one empty line in a row.
            pairs = zip(above, ["x", *above], strict=False)
            place.entry.above[:] = [line for line, before in pairs if line or before]

    def _walk(self, collection: Collection, above: tuple[Collection, ...]) -> Iterator[_EntryPlace]:
        """Entries that get a line of their own."""
        within = (*above, collection)
        for entry in collection.entries:
            column = self._column(entry.start if collection.flow else collection.start)
            yield _EntryPlace(entry, within, column)
            if isinstance(entry.value, Collection) and entry.value.is_block:
                yield from self._walk(entry.value, within)

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
        if isinstance(own, Collection) and own.is_block:
            inside = (*inside, own)
        ended = [collection for collection in reversed(inside) if collection not in open_after]
        for collection in ended:
            if collection.flow and collection.start < comment.start < collection.end:
                return collection
        limit = after.column if after else -1
        for collection in ended:
            if not collection.flow and limit < self._column(collection.start) <= column:
                return collection
        return None if after else self._root

    def _blank_before(self, offset: int) -> bool:
        """Whether the line above the one that an entry or comment begins is empty."""
        line = self._line_start(offset)
        if line == 0 or not self._is_empty(line, offset):
            return False
        return not self._text[self._line_start(line - 1) : line].strip()

    def _is_empty(self, start: int, end: int) -> bool:
        return not self._text[start:end].strip("- \t\r\n")

    def _line_start(self, offset: int) -> int:
        return self._lines[bisect_right(self._lines, offset) - 1]

    def _column(self, offset: int) -> int:
        return offset - self._line_start(offset)


def _mark_broken(collection: Collection, offset: int) -> None:
    """Mark the flow collections that a comment at an offset stands in, unless they are empty."""
    if collection.flow and collection.entries and collection.start < offset < collection.end:
        collection.broken = True
    inside = bisect_right(collection.entries, offset, key=lambda entry: entry.start) - 1
    value = collection.entries[inside].value if inside >= 0 else None
    if isinstance(value, Collection):
        _mark_broken(value, offset)


# Scalars as text: plain where it can be, in quotes where it must be.

_FIRST = frozenset("-?:,[]{}#&*!|>'\"%@`")
# The C parser refuses a question mark before a closing bracket.
_FLOW = frozenset(",[]{}?")
_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t", "\r": "\\r"}


def key_text(key: Scalar, flow: bool) -> str:
    """A key; any plain text is one, except those that YAML takes for null or merging."""
    if not key.style and key.raw == key.text and not (flow and "?" in key.raw):
        return key.raw
    plain = _is_plain(key.text, flow) and not is_null(key.text) and key.text != "<<"
    return key.text if plain else quoted(key.text)


def value_text(scalar: Scalar, flow: bool) -> str:
    """A value on one line."""
    if not scalar.style:
        if is_null(scalar.text):
            return "null" if flow or scalar.text else ""
        if scalar.raw == scalar.text and not (flow and "?" in scalar.raw):
            return scalar.raw
    text = scalar.text
    try:
        is_itself = _is_plain(text, flow) and plain_value(text) == text
    except NumberRangeError:
        is_itself = False
    return text if is_itself else quoted(text)


def quoted(text: str) -> str:
    """In double quotes; in single ones if that spares escapes."""
    if ('"' in text or "\\" in text) and text.isprintable():
        return "'" + text.replace("'", "''") + "'"
    return '"' + "".join(_escaped(char) for char in text) + '"'


def _escaped(char: str) -> str:
    if char in _ESCAPES or char.isprintable():
        return _ESCAPES.get(char, char)
    code = ord(char)
    if code < 0x100:
        return f"\\x{code:02x}"
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def _is_plain(text: str, flow: bool) -> bool:
    """Whether a text needs no quotes.

    A colon gets them everywhere: in braces older parsers refuse it, and people misread it.
    """
    if not text or text != text.strip() or not text.isprintable() or text[0] in _FIRST:
        return False
    if ":" in text or " #" in text or text.startswith("..."):
        return False
    return not (flow and _FLOW.intersection(text))
