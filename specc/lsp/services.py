"""What an editor asks of a file or a stretch of it: outline, repairs, layout, calls."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics.sides import settled
from specc.fmt import LayoutError, formatted
from specc.lsp.actions import Action, actions
from specc.lsp.contents import Entry, contents
from specc.lsp.cursor import line_break
from specc.lsp.project import Analysis, Project
from specc.lsp.signature import Signature, signature
from specc.read import read_text


def outline(project: Project, path: str) -> list[Entry]:
    """The definitions of a file, the one inside the other."""
    view = project.view(path)
    return contents(view.index, path, view.shift.to_new) if view else []


def signature_at(project: Project, path: str, offset: int) -> Signature | None:
    """The call whose arguments are being written at an offset."""
    view = project.view(path)
    return signature(view.index if view else None, project.source(path).text, offset)


def repairs(project: Project, path: str, start: int, end: int) -> list[Action]:
    """What can be done about the findings that a stretch of a file touches."""
    found: dict[Action, None] = {}
    for analysis in project.analyses():
        for diagnostic in settled(analysis.diagnostics, analysis.loader.sources):
            source = analysis.loader.sources.get(path)
            if source is None or diagnostic.primary.file != path:
                continue
            first, last = source.offsets(diagnostic.primary)
            if first <= end and start <= last:
                found |= dict.fromkeys(_possible(project, analysis, actions(analysis, diagnostic)))
    return list(found)


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
