"""The canonical layout of a specification's YAML text.

Whether a collection stands on one line or over several is the author's choice, as in gofmt, with
two exceptions: braces that do not fit into the width become a block, and what was broken over
several lines inside braces is joined if it fits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import dropwhile
from operator import not_

from specc.read import read_text
from specc.read.document import comments_in
from specc.schema.keys import is_model, layout
from specc.schema.places import FILE, UNKNOWN, SchemaNode
from specc.tools.fmt import scalars
from specc.tools.fmt.attach import Attacher
from specc.tools.fmt.scalars import key_text, value_text
from specc.tools.fmt.tree import Alias, Collection, Entry, Scalar, YamlValue, parse

WIDTH = 100
"""Columns of a line, without the comment at its end."""
_STEP = 2


class LayoutError(Exception):
    """The new layout would change what the file says; the file is left alone."""


def formatted(text: str, change: Callable[[Collection], None] | None = None) -> str:
    """The canonical layout of a text that is YAML without faults, after a change of its tree.

    Raises:
        LayoutError: data or comments would not survive.
    """
    root, scalars = parse(text)
    comments = comments_in(text, [(scalar.start, scalar.end) for scalar in scalars])
    if not isinstance(root, Collection):
        return text
    Attacher(text, root).attach(comments)
    if change is not None:
        change(root)
    lines = dropwhile(not_, _Printer(text).lines(root, FILE))
    new = "".join(f"{line.rstrip()}\n" for line in lines)
    if new != text:
        _compare(text, new, [comment.text for comment in comments], same=change is None)
    return new


class _Printer:
    def __init__(self, text: str) -> None:
        self._text = text

    def lines(self, whole: Collection, here: SchemaNode, margin: int = 0) -> Iterator[str]:
        """A collection as a block, without the indentation of `margin` columns that it will get."""
        columns = self._table(whole) if here.is_table else None
        entries = _ordered(whole, here)
        for number, entry in enumerate(entries):
            above = entry.above if number else [*dropwhile(not_, entry.above)]
            if columns and number == 0:
                above = [*above[:-1], *self._header(above[-1:], columns)]
            yield from above
            step = number if entry.key is None else entry.key.text
            yield from self._entry(entry, here.below(step), columns, margin)
        yield from whole.below

    def _entry(
        self, entry: Entry, here: SchemaNode, columns: list[int] | None, margin: int
    ) -> Iterator[str]:
        value = entry.value
        key = entry.key
        head = "-" if key is None else f"{_anchored(key, key_text(key, flow=False))}:"
        if value.anchor:
            head += f" &{value.anchor}"
        beside = f" {entry.beside}" if entry.beside else ""
        if isinstance(value, Scalar) and value.style in ("|", ">") and _keeps_block(value):
            header, *body = value.raw.splitlines()
            yield f"{head} {header.split()[0]}{beside}"
            yield from _indented(_dedented(body))
        elif columns and _is_row(value, len(columns)):
            yield f"{head} {scalars.row(self._cells(value), columns)}{beside}"
        elif (inline := self._inline(value, here, margin + len(head))) is not None:
            yield f"{head} {inline}".rstrip() + beside
        else:
            assert isinstance(value, Collection)
            yield from self._block(head, entry, value, here, margin + _STEP)

    def _block(
        self, head: str, entry: Entry, value: Collection, here: SchemaNode, margin: int
    ) -> Iterator[str]:
        inner = list(self.lines(value, here, margin))
        if head == "-":
            # What stands between a dash and its block belongs above the dash.
            if entry.beside:
                yield entry.beside
            while not inner[0] or inner[0].startswith("#"):
                yield inner.pop(0)
            yield f"- {inner.pop(0)}"
        else:
            yield f"{head} {entry.beside}".rstrip()
        yield from _indented(inner)

    def _inline(self, value: YamlValue, here: SchemaNode, taken: int) -> str | None:
        """The value on one line; None if it takes several."""
        if isinstance(value, Scalar):
            return value_text(value, flow=False)
        if isinstance(value, Alias):
            return f"*{value.name}"
        if value.broken or (not value.flow and value.entries) or value.below:
            return None
        # The head of the line has the anchor.
        line = self._collected(value, here)
        wide = taken + 1 + len(line) > WIDTH
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

    def _table(self, whole: Collection) -> list[int] | None:
        """Widths of the columns of a list of rows that are all as long as the first."""
        lengths = [
            len(entry.value.entries)
            for entry in whole.entries
            if isinstance(entry.value, Collection) and not entry.value.is_mapping
        ]
        if not lengths or lengths[0] < 2:
            return None
        rows = [self._cells(e.value) for e in whole.entries if _is_row(e.value, lengths[0])]
        if not rows:
            return None
        above = whole.entries[0].above[-1:]
        return scalars.widths(rows, scalars.header_cells(above[0], lengths[0]) if above else None)

    def _header(self, comment: list[str], columns: list[int]) -> list[str]:
        cells = scalars.header_cells(comment[0], len(columns)) if comment else None
        return [scalars.header_line(cells, columns)] if cells else comment


def _ordered(whole: Collection, here: SchemaNode) -> list[Entry]:
    """Entries in the order of their keys; those with names that people choose keep theirs."""
    # An alias must come behind its anchor.
    if not whole.is_mapping or whole.linked or not is_model(here.kind):
        return whole.entries
    known = layout(here.kind)
    ranks = {name: rank for rank, name in enumerate(known)}
    return sorted(whole.entries, key=lambda entry: ranks.get(entry.name, len(known)))


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
    return plain and value.flow and not value.is_mapping and not value.broken


def _keeps_block(value: Scalar) -> bool:
    """Whether a block scalar can be moved as it is: no indentation given, no lines kept below."""
    header = value.raw.split("\n", 1)[0].split("#")[0].strip()
    return header in ("|", ">", "|-", ">-") and bool(value.text.strip())


def _dedented(body: list[str]) -> list[str]:
    while body and not body[-1].strip():
        body.pop()
    first = next(line for line in body if line.strip())
    margin = len(first) - len(first.lstrip(" "))
    return [line[margin:] for line in body]


def _indented(lines: list[str]) -> Iterator[str]:
    return (f"{' ' * _STEP}{line}" if line else "" for line in lines)


def _anchored(value: Scalar | Collection, text: str) -> str:
    return f"&{value.anchor} {text}" if value.anchor else text


def _has_braces(value: YamlValue) -> bool:
    """Whether there is a mapping in it: lists of plain values stay on their line."""
    if not isinstance(value, Collection):
        return False
    return value.is_mapping or any(_has_braces(entry.value) for entry in value.entries)


def _compare(old: str, new: str, comments: list[str], *, same: bool) -> None:
    before, after = read_text("old", old), read_text("new", new)
    if same and repr(_sorted(before.data)) != repr(_sorted(after.data)):
        raise LayoutError("the data would change")
    _, scalars = parse(new)
    kept = comments_in(new, [(scalar.start, scalar.end) for scalar in scalars])
    if _letters(comments) != _letters([comment.text for comment in kept]):
        raise LayoutError("a comment would be lost")


def _letters(comments: list[str]) -> list[str]:
    """What comments consist of; they may be joined, moved with their keys and aligned."""
    return sorted("".join("".join(comments).split()))


def _sorted(data: object) -> object:
    """Data whose text does not depend on the order of keys."""
    if isinstance(data, dict):
        return [(key, _sorted(data[key])) for key in sorted(data)]
    return [_sorted(item) for item in data] if isinstance(data, list) else data
