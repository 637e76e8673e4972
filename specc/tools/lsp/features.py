"""What an editor offers for a place, a range or all of a file, in offsets instead of positions."""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from specc.analysis import RowVerdictAt
from specc.diagnostics import Diagnostic, Fix
from specc.diagnostics.renaming import with_repairs_of_typos
from specc.diagnostics.report import repair
from specc.model.fsm import OTHERWISE, cause_words
from specc.read import read_text
from specc.resources import is_library_part, on_disk
from specc.schema.places import names_used_file, role_of
from specc.source import Place, Route, SourceFile, Sources, TextNode, beside
from specc.tools.fmt import LayoutError, format_text
from specc.tools.lsp.completion import Completion, complete
from specc.tools.lsp.cursor import CallSignature, line_break, signature
from specc.tools.lsp.describe import (
    OutlineEntry,
    code_at,
    describe_cause,
    describe_key,
    describe_part,
    describe_symbol,
    outline_of,
)
from specc.tools.lsp.index import Index, Occurrence
from specc.tools.lsp.project import Analysis, FileEdit, Project, TextRange, View
from specc.tools.lsp.rename import RenameError, check_renameable, rename
from specc.tools.parts import as_markdown, summary_of

# Diagnostics of all files that take part.


_UNUSED_IGNORE = "W0901"


@dataclass(frozen=True, slots=True)
class Note:
    """A diagnostic where it is in the present texts."""

    diagnostic: Diagnostic
    range: TextRange
    related: tuple[tuple[TextRange, str], ...]


def notes(project: Project) -> dict[str, list[Note]]:
    """What is wrong, by file; every file that was read has an entry.

    Of files with errors, the findings of the last good analysis are repeated where they are now.
    """
    found: dict[str, Counter[Note]] = {}
    readers: Counter[str] = Counter()
    for analysis in project.analyses():
        for source in analysis.sources:
            found.setdefault(source.path, Counter())
            readers[source.path] += 1
        present = ((analysis.sources, each) for each in analysis.diagnostics)
        for each in dict.fromkeys((*present, *project.earlier_findings(analysis))):
            if (note := _note(project, *each)) is not None:
                found.setdefault(note.range.path, Counter())[note] += 1
    return {
        path: [
            note
            for note, count in noted.items()
            # An ignore comment is unused only if no specification that reads the file needs it.
            if note.diagnostic.code != _UNUSED_IGNORE or count >= readers[path]
        ]
        for path, noted in found.items()
    }


def _note(project: Project, sources: Sources, found: Diagnostic) -> Note | None:
    where = project.present_range(sources, found.primary)
    if where is None:
        return None
    related = (
        (project.present_range(sources, other.place), other.message) for other in found.related
    )
    return Note(found, where, tuple((place, words) for place, words in related if place))


# What stands at an offset.


@dataclass(frozen=True, slots=True)
class Hover:
    """Markdown about a range."""

    text: str
    range: TextRange


@dataclass(frozen=True, slots=True)
class _Cursor:
    """An offset in the analysed text of a file, and the name that stands there."""

    view: View
    path: str
    at: int
    occurrence: Occurrence | None


def _cursor(project: Project, path: str, offset: int) -> _Cursor | None:
    """None if nothing is known of what stands at an offset of the present text."""
    view = project.view(path)
    at = view.shift(path).to_old(offset) if view else None
    if view is None or at is None:
        return None
    return _Cursor(view, path, at, view.index.name_at(path, at))


def hover(project: Project, path: str, offset: int) -> Hover | None:
    """What is known of the name, the part of an expression or the key at an offset."""
    here = _cursor(project, path, offset)
    described = _described(here.view.index, here) if here else None
    if here is None or described is None:
        return None
    text, start, end = described
    where = here.view.present_range(path, start, end)
    return Hover(text, where) if where else None


def _described(index: Index, here: _Cursor) -> tuple[str, int, int] | None:
    """The description of what stands at a place, and its range."""
    name = here.occurrence
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
        text = describe_key(route) if is_key else _of_value(index, here.path, route, node)
        if text:
            return text, node.start, node.end
    return code_at(index.text(here.path), here.at)


def _of_value(index: Index, path: str, route: Route, node: TextNode) -> str:
    """The description of a value that names no symbol: a part of the library, a cause."""
    if names_used_file(route) and is_library_part(node.scalar or ""):
        part = summary_of(node.scalar or "")
        return as_markdown(part) if part else ""
    return describe_cause(index, path, route, node)


def definition(project: Project, path: str, offset: int) -> list[TextRange]:
    """Where the symbol at an offset is defined: all ends of a connection; or the file named."""
    here = _cursor(project, path, offset)
    if here is None:
        return []
    index = here.view.index
    if here.occurrence is None:
        route, node, is_key = index.value_at(path, here.at) or ((), None, False)
        role = role_of(route)
        if node is None or is_key or role is None or role.form != "path":
            return []
        file = beside(path, node.scalar or "")
        return [TextRange(file, 0, 0)] if os.path.isfile(on_disk(file)) else []
    places = dict.fromkeys(end.place for end in here.occurrence.symbol.declarations)
    ranges = (here.view.present_range(place.file, *index.offsets(place)) for place in places)
    return [each for each in ranges if each]


def references(
    project: Project, path: str, offset: int, *, declarations: bool = True
) -> list[TextRange]:
    """Every place that names the symbol at an offset."""
    here = _cursor(project, path, offset)
    if here is None or here.occurrence is None:
        return []
    found = {
        here.view.present_range(file, other.start, other.end)
        for file, other in here.view.index.occurrences_of(here.occurrence.symbol.declarations)
        if declarations or not other.defines
    }
    return sorted((each for each in found if each), key=lambda each: (each.path, each.start))


def completions(project: Project, path: str, offset: int) -> list[Completion]:
    """What can be written at an offset."""
    view = project.view(path)
    return complete(view.index if view else None, path, project.source(path).text, offset)


def signature_at(project: Project, path: str, offset: int) -> CallSignature | None:
    """The call whose arguments are being written at an offset."""
    view = project.view(path)
    system = view.index.system if view else None
    operators = system.operators if system else ()
    generics = [g for s in (system.subsystems if system else ()) for g in s.generics]
    return signature(operators, generics, project.source(path).text, offset)


def renameable(project: Project, path: str, offset: int) -> TextRange | None:
    """The name at an offset if it can be another; raises `RenameError` with the reason if not."""
    here = _cursor(project, path, offset)
    if here is None or here.occurrence is None:
        return None
    check_renameable(here.view.index, here.occurrence.symbol)
    return here.view.present_range(path, here.occurrence.start, here.occurrence.end)


def rename_at(project: Project, path: str, offset: int, new: str) -> list[FileEdit]:
    """The edits that rename the symbol at an offset; raises `RenameError`."""
    here = _cursor(project, path, offset)
    if here is None or here.occurrence is None:
        raise RenameError("there is no known name here")
    return rename(project, here.view.index, here.occurrence.symbol, new)


# All of a file: outline and layout.


def outline(project: Project, path: str) -> list[OutlineEntry]:
    """The definitions of a file, the one inside the other."""
    view = project.view(path)
    return outline_of(view.index, path, view.shift(path).to_new) if view else []


def layout(project: Project, path: str) -> str | None:
    """The text in the canonical layout; None if it has errors or has that layout already."""
    text = project.source(path).text
    if not project.is_specification(path) or not read_text(path, text).ok:
        return None
    try:
        new = format_text(text)
    except LayoutError:
        return None
    new = new.replace("\n", line_break(text))
    return None if new == text else new


# Repairs that an editor offers: those that findings carry, and rows that are missing.


_NO_ROW_APPLIES, _NO_ROW, _NO_ROW_YET = "E0601", "E0603", "O0605"


@dataclass(frozen=True, slots=True)
class Action:
    """What can be done about a finding; `preferred` if it is the one safe way."""

    title: str
    diagnostic: Diagnostic
    changes: tuple[FileEdit, ...]
    preferred: bool


def repairs(project: Project, path: str, start: int, end: int) -> list[Action]:
    """What can be done about the findings in a range of a file."""
    found: dict[object, Action] = {}
    for analysis in project.analyses():
        source = analysis.sources.get(path)
        if source is None or is_library_part(path):
            continue
        for diagnostic in with_repairs_of_typos(analysis.diagnostics, analysis.sources):
            first, last = source.offsets(diagnostic.primary)
            if diagnostic.primary.file == path and first <= end and start <= last:
                for action in _actions(analysis, diagnostic):
                    paths = (each.path for each in action.changes)
                    texts = ((analysis.sources.get(path), project.source(path)) for path in paths)
                    if all(one is not None and one.text == now.text for one, now in texts):
                        # The copies of one text have one repair.
                        found.setdefault((action.title, action.changes), action)
    return list(found.values())


def _actions(analysis: Analysis, diagnostic: Diagnostic) -> Iterator[Action]:
    if diagnostic.fix is not None and (changes := _fixed(analysis, diagnostic.fix)):
        title = diagnostic.fix.title
        yield Action(title[:1].upper() + title[1:], diagnostic, changes, preferred=True)
    if diagnostic.code in (_NO_ROW_APPLIES, _NO_ROW, _NO_ROW_YET):
        yield from _rows(analysis, diagnostic)


def _fixed(analysis: Analysis, fix: Fix) -> tuple[FileEdit, ...]:
    found = repair(fix, analysis.sources)
    path = fix.edits[0].place.file
    if found is None or is_library_part(path):
        return ()
    return tuple(FileEdit(path, c.start, c.end, c.text) for c in found.changes)


def _rows(analysis: Analysis, diagnostic: Diagnostic) -> Iterator[Action]:
    """A row for each cause that the table lacks, which leads back to the state itself."""
    facts = analysis.result.proofs
    verdicts = [v for v in facts.row_verdicts if _is_about(diagnostic, v)] if facts else []
    related = {place.place for place in diagnostic.related}
    for verdict in verdicts:
        if verdict.state.place == diagnostic.primary:
            alike = (v for v in verdicts if v.state.place in related and v.cause == verdict.cause)
            lacking = [verdict, *alike]
            changes = tuple(_insertions(analysis, lacking))
            if changes:
                names = ", ".join(each.state.name for each in lacking)
                cause = cause_words(verdict.cause)
                condition = f"{cause} condition" if cause == verdict.cause else cause
                title = f"Insert a row for the {condition} of {names}"
                yield Action(title, diagnostic, changes, preferred=False)


def _is_about(diagnostic: Diagnostic, decided: RowVerdictAt) -> bool:
    """Whether a finding can be about the rows of a state and cause."""
    rows, decision = decided.verdict.rows, decided.verdict.decision
    wanted = (_NO_ROW_APPLIES,) if rows else (_NO_ROW, _NO_ROW_YET)
    return diagnostic.code in wanted and bool(decision.gap if rows else decision.possible)


def _insertions(analysis: Analysis, lacking: Sequence[RowVerdictAt]) -> Iterator[FileEdit]:
    """A row behind the last one of each state."""
    first, place = lacking[0], lacking[0].state.place
    source = analysis.sources.get(place.file)
    name = OTHERWISE if first.verdict.rows else "always"
    if any((c.kind, c.name) == ("initial", name) for c in first.subsystem.conditions):
        return  # the word has a meaning of its own here
    for each in lacking:
        state = each.state.name
        # The rows of the file, by their steps in the table: one may be of several states.
        rows = [r.place.route[-1] for r in each.subsystem.transitions if r.source == state]
        text = f"[{state}, {each.cause}, {name}, {state}]"
        route = (*place.route[:-2], "transitions")
        table = source.node(route) if source else None
        if source is not None and table is not None and table.values:
            yield _row_behind(
                source, table, rows[-1] if rows else next(reversed(table.values)), text
            )


def _row_behind(source: SourceFile, table: TextNode, last: str | int, text: str) -> FileEdit:
    """A new row behind the one at the step `last`, which has a key where rows have names."""
    before, key = table.values[last], table.keys.get(last)
    if source.text[table.start] in "[{":
        return FileEdit(source.path, before.end, before.end, f", {text}")
    begin = key.start if key else source.text.rindex("-", 0, before.start)
    line = source.line_starts[bisect_right(source.line_starts, begin) - 1]
    line_end = re.compile(r"[\r\n]|\Z").search(source.text, before.end)
    end = line_end.start() if line_end else len(source.text)
    indent, dash = source.text[line:begin], "" if key else "- "
    row = f"{line_break(source.text)}{' ' * len(indent)}{dash}{text}"
    return FileEdit(source.path, end, end, row)
