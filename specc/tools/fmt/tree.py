"""A YAML text as a tree that a printer can lay out anew: values, styles, anchors and comments."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

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

_BLANK = re.compile(r"(?:\s+(?:#[^\r\n]*)?)*")
"""White space and the comments in it."""


@dataclass(eq=False, slots=True)
class Scalar:
    """A scalar: its value, its style and its characters in the text.

    As of every value, `begin` is where it begins, `start` where what follows its anchor does.
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
    def linked(self) -> bool:
        """Whether something below has an anchor or is an alias, so that order matters."""
        return any(
            entry.value.anchor
            or isinstance(entry.value, Alias)
            or (isinstance(entry.value, Collection) and entry.value.linked)
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
    start = _behind_anchor(text, begin, anchor)
    if isinstance(event, ScalarEvent):
        start = min(start, end)
        raw = text[start:end]
        scalar = Scalar(event.value, event.style or "", raw, begin, start, end, anchor)
        scalars.append(scalar)
        return scalar
    is_mapping = isinstance(event, MappingStartEvent)
    whole = Collection(is_mapping, bool(event.flow_style), begin, start, end, anchor)
    for inner in stream:
        if isinstance(inner, (MappingEndEvent, SequenceEndEvent)):
            whole.end = inner.end_mark.index
            break
        first = _value(inner, stream, text, scalars)
        if is_mapping:
            value = _value(next(stream), stream, text, scalars)
            assert isinstance(first, Scalar) and value is not None
            whole.entries.append(Entry(first, value))
        else:
            assert first is not None
            whole.entries.append(Entry(None, first))
    return whole


def _behind_anchor(text: str, begin: int, anchor: str) -> int:
    """Where the content of a value begins; its event begins with its anchor."""
    if not anchor:
        return begin
    found = _BLANK.match(text, begin + 1 + len(anchor))
    return found.end() if found else begin
