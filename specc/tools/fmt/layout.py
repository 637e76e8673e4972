"""The canonical layout of a specification's YAML text.

Whether a collection stands on one line or over several is the author's choice, as in gofmt, with
two exceptions: braces that do not fit into the width become a block, and what was broken over
several lines inside braces is joined if it fits.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import dropwhile
from operator import not_
from pprint import pformat

from specc.read import read_text
from specc.read.document import comments_in
from specc.schema.keys import is_model, layout
from specc.schema.places import FILE, UNKNOWN, SchemaNode
from specc.tools.fmt.tree import (
    Alias,
    Collection,
    Entry,
    Scalar,
    YamlValue,
    attach_comments,
    key_text,
    parse,
    value_text,
)

WIDTH = 100
"""Columns of a line, without the comment at its end."""
_STEP = 2


class LayoutError(Exception):
    """The new layout would change what the file says; the file is left alone."""


def format_text(text: str, change: Callable[[Collection], None] | None = None) -> str:
    """The canonical layout of a text that is YAML without faults, after a change of its tree.

    Raises:
        LayoutError: data or comments would not survive.
    """
    root, scalars = parse(text)
    comments = comments_in(text, [(scalar.start, scalar.end) for scalar in scalars])
    if not isinstance(root, Collection):
        return text
    attach_comments(text, root, comments)
    if change is not None:
        change(root)
    lines = dropwhile(not_, _Printer(text).lines(root, FILE))
    new = "".join(f"{line.rstrip()}\n" for line in lines)
    if new != text:
        _check_unchanged(
            text, new, [comment.text for comment in comments], same_data=change is None
        )
    return new


class _Printer:
    def __init__(self, text: str) -> None:
        self._text = text

    def lines(self, collection: Collection, here: SchemaNode, margin: int = 0) -> Iterator[str]:
        """A collection as a block, without the indentation of `margin` columns that it will get."""
        table = self._table(collection, margin) if here.is_table else None
        entries = _ordered(collection, here)
        for number, entry in enumerate(entries):
            above = [*entry.above] if number else [*dropwhile(not_, entry.above)]
            if table and number == 0 and (header := _header_cells(above[-1:], len(table.widths))):
                pairs = zip(header[0], table.widths, strict=True)
                above[-1] = f"#  {''.join(cell.ljust(width) for cell, width in pairs).rstrip()}"
            yield from above
            step = number if entry.key is None else entry.key.text
            yield from self._entry(entry, here.below(step), table, margin)
        yield from collection.below

    def _entry(
        self, entry: Entry, here: SchemaNode, table: _Table | None, margin: int
    ) -> Iterator[str]:
        value = entry.value
        key = entry.key
        head = "-" if key is None else f"{_anchored(key, key_text(key, flow=False))}:"
        if value.anchor:
            head += f" &{value.anchor}"
        beside = f" {entry.beside}" if entry.beside else ""
        if isinstance(value, Scalar) and value.style in ("|", ">") and _can_keep_block(value):
            header, *body = value.raw.splitlines()
            yield f"{head} {header.split()[0]}{beside}"
            while not body[-1].strip():
                body.pop()
            first = next(line for line in body if line.strip())
            margin = len(first) - len(first.lstrip(" "))
            yield from _indented([line[margin:] for line in body])
        elif table and _is_row(value, len(table.widths)):
            assert isinstance(value, Collection)
            if value.begin in table.aligned:
                *cells, last = self._cells(value)
                pairs = zip(cells, table.widths, strict=False)
                padded = (f"{cell}, ".ljust(width) for cell, width in pairs)
                lines = [f"{head} [{''.join(padded)}{last}]"]
            else:
                lines = [*self._filled(value, head, margin)]
            yield from lines[:-1]
            yield lines[-1] + beside
        elif (inline := self._inline(value, here, margin + len(head))) is not None:
            yield f"{head} {inline}".rstrip() + beside
        else:
            assert isinstance(value, Collection)
            inner = list(self.lines(value, here, margin + _STEP))
            if head == "-":
                # What stands between a dash and its block belongs above the dash.
                above = [entry.beside] if entry.beside else []
                while not inner[0] or inner[0].startswith("#"):
                    above.append(inner.pop(0))
                yield from above
                head = f"{head} {inner.pop(0)}"
            else:
                head = f"{head} {entry.beside}".rstrip()
            yield head
            yield from _indented(inner)

    def _inline(self, value: YamlValue, here: SchemaNode, indent: int) -> str | None:
        """The value on one line; None if it takes several."""
        if isinstance(value, Scalar):
            return value_text(value, flow=False)
        if isinstance(value, Alias):
            return f"*{value.name}"
        if value.broken or (not value.flow and value.entries) or value.below:
            return None
        # The head of the line has the anchor.
        line = self._collected(value, here)
        wide = indent + 1 + len(line) > WIDTH
        several = "\n" in self._text[value.start : value.end]
        return None if wide and (several or _has_braces(value)) else line

    def _flow(self, value: YamlValue, here: SchemaNode) -> str:
        if isinstance(value, Scalar):
            return _anchored(value, value_text(value, flow=True))
        if isinstance(value, Alias):
            return f"*{value.name}"
        return _anchored(value, self._collected(value, here))

    def _collected(self, value: Collection, here: SchemaNode) -> str:
        parts = []
        for number, entry in enumerate(_ordered(value, here)):
            step = number if entry.key is None else entry.key.text
            text = self._flow(entry.value, here.below(step))
            if entry.key is not None:
                key = _anchored(entry.key, key_text(entry.key, flow=True))
                text = f"{key}: {text}"
            parts.append(text)
        joined = ", ".join(parts)
        return f"{{{joined}}}" if value.is_mapping else f"[{joined}]"

    def _cells(self, value: YamlValue) -> list[str]:
        assert isinstance(value, Collection)
        return [self._flow(entry.value, UNKNOWN) for entry in value.entries]

    def _table(self, rows: Collection, margin: int) -> _Table | None:
        """The columns of a list of rows that are as long as its first row.

        A width includes the comma and the blanks behind it, and the header comment counts. Rows
        with the longest cells are left out until the others fit into the width.
        """
        lists = (entry.value for entry in rows.entries)
        first = next((v for v in lists if isinstance(v, Collection) and not v.is_mapping), None)
        length = len(first.entries) if first else 0
        found = [
            (e.value.begin, self._cells(e.value)) for e in rows.entries if _is_row(e.value, length)
        ]
        if length < 2 or not found:
            return None
        header = _header_cells(rows.entries[0].above[-1:], length)
        room = WIDTH - margin - len("- []")
        aligned = {begin: cells for begin, cells in found if len(", ".join(cells)) <= room}
        while True:
            widths = [
                max((len(cell) + 2 for cell in column), default=0)
                for column in zip(*aligned.values(), *header, strict=True)
            ] or [0] * length
            if all(sum(widths[:-1]) + len(cells[-1]) <= room for cells in aligned.values()):
                return _Table(widths, frozenset(aligned))
            longest = max(len(cell) for cells in aligned.values() for cell in cells[:-1])
            aligned = {
                begin: cells
                for begin, cells in aligned.items()
                if all(len(cell) < longest for cell in cells[:-1])
            }

    def _filled(self, row: Collection, head: str, margin: int) -> Iterator[str]:
        """A row that is not aligned, on as many lines as it needs."""
        line = f"{head} ["
        inner = " " * len(line)
        words: list[tuple[str, str]] = []  # with what stands before one that begins a line
        for entry in row.entries:
            cell = entry.value
            if isinstance(cell, Collection) and cell.entries:
                items = [self._flow(item.value, UNKNOWN) for item in cell.entries]
                items[0] = _anchored(cell, f"[{items[0]}")
                items[-1] += "]"
                words += [(item, f"{inner} " if n else inner) for n, item in enumerate(items)]
            else:
                words.append((self._flow(cell, UNKNOWN), inner))
        for number, (word, before) in enumerate(words):
            text = f"{word}," if number < len(words) - 1 else f"{word}]"
            if number and margin + len(line) + 1 + len(text) > WIDTH:
                yield line
                line = before + text
            else:
                line += f" {text}" if number else text
        yield line


@dataclass(frozen=True, slots=True)
class _Table:
    """The widths of columns, and where the rows begin that have them."""

    widths: list[int]
    aligned: frozenset[int]


_GAP = re.compile(r"\s{2,}")


def _header_cells(comment: list[str], columns: int) -> list[list[str]]:
    """The words over the columns, if a comment has as many of them, two blanks apart."""
    cells = [_GAP.split(text.removeprefix("#").strip()) for text in comment]
    return [each for each in cells if len(each) == columns]


def _ordered(collection: Collection, here: SchemaNode) -> list[Entry]:
    """Entries in the order of their keys; those with names that people choose keep theirs."""
    # An alias must come behind its anchor.
    if not collection.is_mapping or collection.has_links or not is_model(here.kind):
        return collection.entries
    known = layout(here.kind)
    ranks = {name: rank for rank, name in enumerate(known)}
    return sorted(collection.entries, key=lambda entry: ranks.get(entry.name, len(known)))


def _is_row(value: YamlValue, columns: int) -> bool:
    return (
        isinstance(value, Collection)
        and not value.is_mapping
        and not value.broken
        and not value.anchor
        and (value.flow or not value.entries)
        and len(value.entries) == columns
        and all(_is_cell(entry.value) for entry in value.entries)
    )


def _is_cell(value: YamlValue) -> bool:
    """Whether it is one value, or a list of some on one line, as the states of a row are."""
    if not isinstance(value, Collection):
        return True
    plain = all(not isinstance(entry.value, Collection) for entry in value.entries)
    return plain and not value.is_block and not value.is_mapping


def _can_keep_block(value: Scalar) -> bool:
    """Whether a block scalar can be moved as it is: no indentation given, no lines kept below."""
    header = value.raw.split("\n", 1)[0].split("#")[0].strip()
    return header in ("|", ">", "|-", ">-") and bool(value.text.strip())


def _indented(lines: list[str]) -> Iterator[str]:
    return (f"{' ' * _STEP}{line}" if line else "" for line in lines)


def _anchored(value: Scalar | Collection, text: str) -> str:
    return f"&{value.anchor} {text}" if value.anchor else text


def _has_braces(value: YamlValue) -> bool:
    """Whether there is a mapping in it: lists of plain values stay on their line."""
    if not isinstance(value, Collection):
        return False
    return value.is_mapping or any(_has_braces(entry.value) for entry in value.entries)


def _check_unchanged(old: str, new: str, comments: list[str], *, same_data: bool) -> None:
    """Raise LayoutError if the data (with `same_data`) or a comment would change."""
    before, after = read_text("old", old), read_text("new", new)
    if same_data and pformat(before.data) != pformat(after.data):
        raise LayoutError("the data would change")
    _, scalars = parse(new)
    found = comments_in(new, [(scalar.start, scalar.end) for scalar in scalars])
    if _letters(comments) != _letters([comment.text for comment in found]):
        raise LayoutError("a comment would be lost")


def _letters(comments: list[str]) -> list[str]:
    """What comments consist of; they may be joined, moved with their keys and aligned."""
    return sorted("".join("".join(comments).split()))
