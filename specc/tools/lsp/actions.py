"""Code actions and the other services of an editor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from specc.analysis import RowVerdictAt
from specc.diagnostics import Diagnostic, Fix
from specc.diagnostics.renaming import offer_both_renames
from specc.diagnostics.report import repair
from specc.model.fsm import OTHERWISE
from specc.read import read_text
from specc.resources import is_library_part
from specc.source import Place, Route, SourceFile, TextNode
from specc.tools.fmt import LayoutError, formatted
from specc.tools.lsp.cursor import line_break
from specc.tools.lsp.describe import OutlineEntry, contents
from specc.tools.lsp.project import Analysis, FileEdit, Project
from specc.tools.lsp.signature import CallSignature, signature

# Repairs that an editor offers: those that findings carry, and rows that are missing.


_NO_ROW_APPLIES, _NO_ROW, _NO_ROW_YET = "E0601", "E0603", "O0605"


@dataclass(frozen=True, slots=True)
class Action:
    """What can be done about a finding; `preferred` if it is the one safe way."""

    title: str
    diagnostic: Diagnostic
    changes: tuple[FileEdit, ...]
    preferred: bool


def actions(analysis: Analysis, diagnostic: Diagnostic) -> Iterator[Action]:
    """The ways out of a finding that are edits; nobody edits the library."""
    if is_library_part(diagnostic.primary.file):
        return
    if diagnostic.fix is not None:
        changes = _fixed(analysis, diagnostic.fix)
        if changes:
            yield Action(_sentence(diagnostic.fix.title), diagnostic, changes, preferred=True)
    if diagnostic.code in (_NO_ROW_APPLIES, _NO_ROW, _NO_ROW_YET):
        yield from _rows(analysis, diagnostic)


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:]


def _fixed(analysis: Analysis, fix: Fix) -> tuple[FileEdit, ...]:
    found = repair(fix, analysis.loader.sources)
    path = fix.edits[0].place.file
    if found is None or is_library_part(path):
        return ()
    return tuple(FileEdit(path, c.start, c.end, c.text) for c in found.changes)


def _rows(analysis: Analysis, diagnostic: Diagnostic) -> Iterator[Action]:
    """A row for each cause that the table forgets; where it leads is for somebody to edit."""
    for decided in _decided(analysis):
        if decided.state.place != diagnostic.primary or not _is_about(diagnostic, decided):
            continue
        told = {place.place for place in diagnostic.related}
        others = [
            other
            for other in _decided(analysis)
            if other.state.place in told
            and other.cause == decided.cause
            and _is_about(diagnostic, other)
        ]
        changes = tuple(_insertions(analysis, decided, others))
        if changes:
            names = ", ".join(d.state.name for d in (decided, *others))
            title = f"Insert a row for the {decided.cause} condition of {names}"
            yield Action(title, diagnostic, changes, preferred=False)


def _decided(analysis: Analysis) -> tuple[RowVerdictAt, ...]:
    proofs = analysis.result.proofs
    return proofs.row_verdicts if proofs else ()


def _is_about(diagnostic: Diagnostic, decided: RowVerdictAt) -> bool:
    """Whether a finding can be about the rows of a state and cause."""
    rows, decision = decided.verdict.rows, decided.verdict.decision
    wanted = (_NO_ROW_APPLIES,) if rows else (_NO_ROW, _NO_ROW_YET)
    return diagnostic.code in wanted and bool(decision.gap if rows else decision.possible)


def _insertions(
    analysis: Analysis, decided: RowVerdictAt, others: Sequence[RowVerdictAt]
) -> Iterator[FileEdit]:
    """A row behind the last one of each state; `others` are those that lack the same row."""
    place = decided.state.place
    source = analysis.loader.sources.get(place.file)
    owner = place.route[:-2]
    name = OTHERWISE if decided.verdict.rows else "always"
    if any((c.kind, c.name) == ("initial", name) for c in decided.subsystem.conditions):
        return  # the word has a meaning of its own here
    for lacking in (decided, *others):
        state = lacking.state.name
        rows = [i for i, t in enumerate(lacking.subsystem.transitions) if t.source == state]
        text = f"[{state}, {lacking.cause}, {name}, {state}]"
        row = _behind(source, (*owner, "transitions"), rows[-1] if rows else None, text)
        if row is not None:
            yield row


def _behind(
    source: SourceFile | None, route: Route, step: int | None, text: str
) -> FileEdit | None:
    """A new entry of a collection behind one of its entries, the last one if it is not given."""
    whole = source.node(route) if source else None
    if source is None or whole is None or not whole.values:
        return None
    last = step if step is not None else next(reversed(whole.values))
    before = whole.values[last]
    if source.text[whole.start] in "[{":
        return FileEdit(source.path, before.end, before.end, f", {text}")
    begin = _begin(source, whole, last)
    line = source.line_starts[source.span(Place(source.path, (*route, last))).line - 1]
    indent = source.text[line:begin]
    end = _line_end(source, before)
    dash = "" if last in whole.keys else "- "
    return FileEdit(
        source.path, end, end, f"{line_break(source.text)}{' ' * len(indent)}{dash}{text}"
    )


def _begin(source: SourceFile, whole: TextNode, step: str | int) -> int:
    key = whole.keys.get(step)
    if key is not None:
        return key.start
    return source.text.rindex("-", 0, whole.values[step].start)


def _line_end(source: SourceFile, node: TextNode) -> int:
    found = [at for at in (source.text.find(c, node.end) for c in "\r\n") if at >= 0]
    return min(found, default=len(source.text))


# What an editor asks of a file or a stretch of it: outline, repairs, layout, calls.


def outline(project: Project, path: str) -> list[OutlineEntry]:
    """The definitions of a file, the one inside the other."""
    view = project.view(path)
    return contents(view.index, path, view.shift.to_new) if view else []


def signature_at(project: Project, path: str, offset: int) -> CallSignature | None:
    """The call whose arguments are being written at an offset."""
    view = project.view(path)
    return signature(view.index if view else None, project.source(path).text, offset)


def repairs(project: Project, path: str, start: int, end: int) -> list[Action]:
    """What can be done about the findings that a stretch of a file touches."""
    found: dict[object, Action] = {}
    for analysis in project.analyses():
        for diagnostic in offer_both_renames(analysis.diagnostics, analysis.loader.sources):
            source = analysis.loader.sources.get(path)
            if source is None or diagnostic.primary.file != path:
                continue
            first, last = source.offsets(diagnostic.primary)
            if first <= end and start <= last:
                for action in _possible(project, analysis, actions(analysis, diagnostic)):
                    # The copies of one text have one repair.
                    found.setdefault((action.title, action.changes), action)
    return list(found.values())


def _possible(project: Project, analysis: Analysis, found: Iterator[Action]) -> Iterator[Action]:
    """Repairs of texts that are still what they were when they were analysed."""
    for action in found:
        sources = (analysis.loader.sources.get(change.path) for change in action.changes)
        if all(s is not None and s.text == project.source(s.path).text for s in sources):
            yield action


def layout(project: Project, path: str) -> str | None:
    """The text in the canonical layout; None if it has errors or has that layout already."""
    text = project.source(path).text
    if not project.is_specification(path) or not read_text(path, text).ok:
        return None
    try:
        new = formatted(text)
    except LayoutError:
        return None
    new = new.replace("\n", line_break(text))
    return None if new == text else new
