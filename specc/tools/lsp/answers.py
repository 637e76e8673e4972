"""Answers to the questions of an editor, in offsets: the features without the protocol."""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass

from specc.diagnostics import Diagnostic
from specc.resources import is_library_part, on_disk
from specc.schema.places import names_used_file, role_of
from specc.source import Place, Route, Sources, TextNode, beside
from specc.tools.lsp.completion import Completion, complete
from specc.tools.lsp.describe import (
    code_at,
    describe_cause,
    describe_key,
    describe_part,
    describe_symbol,
)
from specc.tools.lsp.index import Index
from specc.tools.lsp.project import FileEdit, Project, Stretch, View
from specc.tools.lsp.rename import RenameError, check_renameable, rename
from specc.tools.lsp.unfinished import shift
from specc.tools.parts import as_markdown, summary_of

_UNUSED_IGNORE = "W0901"


@dataclass(frozen=True, slots=True)
class Note:
    """A diagnostic where it is in the texts that were analysed."""

    diagnostic: Diagnostic
    where: Stretch
    related: tuple[tuple[Stretch, str], ...]


@dataclass(frozen=True, slots=True)
class Hover:
    """Markdown about a stretch."""

    text: str
    where: Stretch


def notes(project: Project) -> dict[str, list[Note]]:
    """What is wrong, by file; every file that was read has an entry."""
    found: dict[str, Counter[Note]] = {}
    readers: Counter[str] = Counter()
    for analysis in project.analyses():
        sources = analysis.loader.sources
        for source in sources:
            found.setdefault(source.path, Counter())
            readers[source.path] += 1
        for diagnostic in dict.fromkeys(analysis.diagnostics):
            note = Note(
                diagnostic,
                _stretch(sources, diagnostic.primary),
                tuple((_stretch(sources, r.place), r.message) for r in diagnostic.related),
            )
            found.setdefault(note.where.path, Counter())[note] += 1
    return {
        path: [n for n, count in noted.items() if _counts(n, count, readers[path])]
        for path, noted in found.items()
    }


def _counts(note: Note, count: int, readers: int) -> bool:
    """An ignore comment is unused only if no specification that reads the file has use for it."""
    return note.diagnostic.code != _UNUSED_IGNORE or count >= readers


class Here:
    """A place in a text: what the last index that knows the text has there."""

    def __init__(self, project: Project, view: View, path: str, at: int) -> None:
        """`at` is an offset in the text that was indexed."""
        self.index, self.path, self.at = view.index, path, at
        self.occurrence = view.index.at(path, at)
        self._project, self._view = project, view

    def now(self, start: int, end: int, path: str = "") -> Stretch | None:
        """A stretch of an indexed text in the present one; None if it was edited since."""
        path = path or self.path
        moved = self._view.shift
        if path != self._view.source.path:
            moved = shift(self.index.text(path), self._project.source(path).text)
        first, last = moved.to_new(start), moved.to_new(end)
        return Stretch(path, first, last) if first is not None and last is not None else None


def _here(project: Project, path: str, offset: int) -> Here | None:
    """An offset in the present text of a file; None if nothing is known of what stands there."""
    view = project.view(path)
    at = view.shift.to_old(offset) if view else None
    return Here(project, view, path, at) if view is not None and at is not None else None


def hover(project: Project, path: str, offset: int) -> Hover | None:
    """What is known of the name, the part of an expression or the key at an offset."""
    here = _here(project, path, offset)
    told = _told(here) if here else None
    if here is None or told is None:
        return None
    words, start, end = told
    where = here.now(start, end)
    return Hover(words, where) if where else None


def _told(here: Here) -> tuple[str, int, int] | None:
    """What there is to say of a place, and of which stretch."""
    index, name = here.index, here.occurrence
    if name is not None:
        return describe_symbol(index, name.symbol, name.type), name.start, name.end
    part = index.part_at(here.path, here.at)
    if part is not None:
        meaning, expr = part
        place = Place(here.path, meaning.where.route, "value", *expr.span)
        return describe_part(index, meaning, expr), *index.offsets(place)
    found = index.value_at(here.path, here.at)
    if found is not None:
        route, node, is_key = found
        words = describe_key(route) if is_key else _of_value(index, here.path, route, node)
        if words:
            return words, node.start, node.end
    return code_at(index.text(here.path), here.at)


def _of_value(index: Index, path: str, route: Route, node: TextNode) -> str:
    """What a hover says of a value that no symbol is named by: a part of the library, a cause."""
    if names_used_file(route) and is_library_part(node.scalar or ""):
        part = summary_of(node.scalar or "")
        return as_markdown(part) if part else ""
    return describe_cause(index, path, route, node)


def definition(project: Project, path: str, offset: int) -> list[Stretch]:
    """Where the symbol at an offset is defined: all ends of a connection; or the file named."""
    here = _here(project, path, offset)
    if here is None:
        return []
    if here.occurrence is None:
        return _file_named(here)
    places = dict.fromkeys(end.place for end in here.occurrence.symbol.declarations)
    stretches = (here.now(*here.index.offsets(place), place.file) for place in places)
    return [stretch for stretch in stretches if stretch]


def _file_named(here: Here) -> list[Stretch]:
    """The beginning of the file that a value names."""
    route, node, is_key = here.index.value_at(here.path, here.at) or ((), None, False)
    role = role_of(route)
    if node is None or is_key or role is None or role.form != "path":
        return []
    file = beside(here.path, node.scalar or "")
    return [Stretch(file, 0, 0)] if os.path.isfile(on_disk(file)) else []


def references(project: Project, path: str, offset: int, declarations: bool) -> list[Stretch]:
    """Every place that names the symbol at an offset."""
    here = _here(project, path, offset)
    if here is None or here.occurrence is None:
        return []
    found = {
        here.now(other.start, other.end, file)
        for file, other in here.index.references(here.occurrence.symbol)
        if declarations or not other.defines
    }
    return sorted((s for s in found if s), key=lambda s: (s.path, s.start))


def completions(project: Project, path: str, offset: int) -> list[Completion]:
    """What can be written at an offset."""
    view = project.view(path)
    return complete(view.index if view else None, path, project.source(path).text, offset)


def renameable(project: Project, path: str, offset: int) -> Stretch | None:
    """The name at an offset if it can be another; raises `RenameError` with the reason if not."""
    here = _here(project, path, offset)
    if here is None or here.occurrence is None:
        return None
    check_renameable(here.index, here.occurrence.symbol)
    return here.now(here.occurrence.start, here.occurrence.end)


def rename_at(project: Project, path: str, offset: int, new: str) -> list[FileEdit]:
    """The edits that rename the symbol at an offset; raises `RenameError`."""
    here = _here(project, path, offset)
    if here is None or here.occurrence is None:
        raise RenameError("there is no known name here")
    return rename(project, here.index, here.occurrence.symbol, new)


def _stretch(sources: Sources, place: Place) -> Stretch:
    source = sources.get(place.file)
    return Stretch(place.file, *(source.offsets(place) if source else (0, 0)))
