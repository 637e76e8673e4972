"""Answers to the questions of an editor, in offsets: the features without the protocol."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.frozen import frozen
from specc.schema.places import keys_at, role_of
from specc.source import Place, Sources
from specc.tools.lsp.completion import Completion, complete
from specc.tools.lsp.describe import cause_at, code_at, describe_part, describe_symbol
from specc.tools.lsp.index import Occurrence
from specc.tools.lsp.mending import shift
from specc.tools.lsp.project import Project, View
from specc.tools.lsp.rename import Edit, RenameError, check_renameable, rename
from specc.tools.lsp.symbols import beside, values

_UNUSED_IGNORE = "W0901"


@frozen
class Stretch:
    """A part of the present text of a file, in offsets."""

    path: str
    start: int
    end: int


@frozen
class Note:
    """A diagnostic where it is in the texts that were analysed."""

    diagnostic: Diagnostic
    where: Stretch
    related: tuple[tuple[Stretch, str], ...]


@frozen
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


def hover(project: Project, path: str, offset: int) -> Hover | None:
    """What is known of the name, the part of an expression or the key at an offset."""
    view, at = _earlier(project, path, offset)
    if view is None or at is None:
        return None
    index = view.index
    occurrence = index.at(path, at)
    if occurrence is not None:
        known = occurrence.reference.type
        where = _now(project, view, path, occurrence.start, occurrence.end)
        text = describe_symbol(index, occurrence.symbol, known)
        return Hover(text, where) if where else None
    part = index.part_at(path, at)
    if part is not None:
        meaning, node = part
        route = meaning.where.route
        place = Place(path, route, "value", *node.span)
        where = _now(project, view, path, *index.offsets(place))
        return Hover(describe_part(index, meaning, node), where) if where else None
    return _key_hover(project, view, path, at) or _explained(project, view, path, at)


def definition(project: Project, path: str, offset: int) -> list[Stretch]:
    """Where the symbol at an offset is defined: all ends of a connection; or the file named."""
    view, at = _earlier(project, path, offset)
    if view is None or at is None:
        return []
    occurrence = view.index.at(path, at)
    if occurrence is None:
        return list(_files_at(view, path, at))
    places = [end.place for end in occurrence.symbol.declarations]
    stretches = (_now(project, view, place.file, *view.index.offsets(place)) for place in places)
    return [stretch for stretch in stretches if stretch]


def references(project: Project, path: str, offset: int, declarations: bool) -> list[Stretch]:
    """Every place that names the symbol at an offset."""
    view, at = _earlier(project, path, offset)
    occurrence = view.index.at(path, at) if view and at is not None else None
    if view is None or occurrence is None:
        return []
    found = [
        _now(project, view, file, other.start, other.end)
        for file, other in view.index.references(occurrence.symbol)
        if declarations or not other.reference.defines
    ]
    return sorted({s for s in found if s}, key=lambda s: (s.path, s.start))


def completions(project: Project, path: str, offset: int) -> list[Completion]:
    """What can be written at an offset."""
    view = project.view(path)
    return complete(view.index if view else None, path, project.source(path).text, offset)


def renameable(project: Project, path: str, offset: int) -> Stretch | None:
    """The name at an offset if it can be another; raises `RenameError` with the reason if not."""
    view, at = _earlier(project, path, offset)
    occurrence = view.index.at(path, at) if view and at is not None else None
    if view is None or occurrence is None:
        return None
    check_renameable(view.index, occurrence.symbol)
    return _now(project, view, path, occurrence.start, occurrence.end)


def rename_at(project: Project, path: str, offset: int, new: str) -> list[Edit]:
    """The edits that rename the symbol at an offset; raises `RenameError`."""
    view, at = _earlier(project, path, offset)
    occurrence: Occurrence | None = view.index.at(path, at) if view and at is not None else None
    if view is None or occurrence is None:
        raise RenameError("there is no known name here")
    return rename(project, view.index, occurrence.symbol, new)


def _earlier(project: Project, path: str, offset: int) -> tuple[View | None, int | None]:
    """What is known of a file, and an offset in the text that it is known from."""
    view = project.view(path)
    return view, view.shift.to_old(offset) if view else None


def _now(project: Project, view: View, path: str, start: int, end: int) -> Stretch | None:
    """A stretch of an analysed text in the present one; None if it was edited since."""
    moved = view.shift
    if path != view.source.path:
        moved = shift(view.index.text(path), project.source(path).text)
    first, last = moved.to_new(start), moved.to_new(end)
    return Stretch(path, first, last) if first is not None and last is not None else None


def _stretch(sources: Sources, place: Place) -> Stretch:
    source = sources.get(place.file)
    return Stretch(place.file, *(source.offsets(place) if source else (0, 0)))


def _explained(project: Project, view: View, path: str, at: int) -> Hover | None:
    """What is not a symbol, but has a meaning all the same."""
    index = view.index
    found = cause_at(index, path, at) or code_at(index.text(path), at)
    where = _now(project, view, path, found[1], found[2]) if found else None
    return Hover(found[0], where) if found and where else None


def _key_hover(project: Project, view: View, path: str, at: int) -> Hover | None:
    source = view.index.sources.get(path)
    top = source.spans if source else None
    for route, key, _ in values(top) if top else ():
        if key is not None and key.start <= at <= key.end:
            words = keys_at(route[:-1]).get(str(route[-1]), "")
            where = _now(project, view, path, key.start, key.end)
            return Hover(f"**{route[-1]}**: {words}", where) if words and where else None
    return None


def _files_at(view: View, path: str, at: int) -> Iterator[Stretch]:
    source = view.index.sources.get(path)
    top = source.spans if source else None
    for route, _, node in values(top) if top else ():
        role = role_of(route)
        if role and role.form == "path" and node.scalar and node.start <= at <= node.end:
            file = beside(path, node.scalar)
            if os.path.isfile(file):
                yield Stretch(file, 0, 0)
