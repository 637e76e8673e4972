"""Values of `specc.lsp.answers` as those of the protocol."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from lsprotocol import types as lsp

from specc.lsp.answers import Hover, Note, Stretch
from specc.lsp.completion import Completion
from specc.lsp.positions import Columns, Position
from specc.lsp.project import Project
from specc.lsp.rename import Edit

_SEVERITIES = {
    "error": lsp.DiagnosticSeverity.Error,
    "warning": lsp.DiagnosticSeverity.Warning,
    "open": lsp.DiagnosticSeverity.Information,
}
_KINDS = {
    "key": lsp.CompletionItemKind.Property,
    "value": lsp.CompletionItemKind.Value,
    "member": lsp.CompletionItemKind.EnumMember,
    "memory": lsp.CompletionItemKind.Variable,
    "let": lsp.CompletionItemKind.Variable,
    "constant": lsp.CompletionItemKind.Constant,
    "parameter": lsp.CompletionItemKind.Constant,
    "operator": lsp.CompletionItemKind.Function,
    "builtin": lsp.CompletionItemKind.Function,
    "function": lsp.CompletionItemKind.Method,
    "behaviour": lsp.CompletionItemKind.Method,
    "field": lsp.CompletionItemKind.Field,
    "element": lsp.CompletionItemKind.Field,
    "component": lsp.CompletionItemKind.Field,
    "type": lsp.CompletionItemKind.Class,
    "unit": lsp.CompletionItemKind.Unit,
    "file": lsp.CompletionItemKind.File,
    "clock": lsp.CompletionItemKind.Keyword,
    "subsystem": lsp.CompletionItemKind.Module,
    "inputs": lsp.CompletionItemKind.Module,
}


@dataclass(frozen=True, slots=True)
class Texts:
    """The present texts, the way the client counts in them, and the URIs of paths."""

    project: Project
    columns: Columns
    uri: Callable[[str], str]


def offset(texts: Texts, path: str, position: lsp.Position) -> int:
    """The offset of a position in the present text of a file."""
    where = Position(position.line, position.character)
    return texts.columns.offset_at(texts.project.source(path), where)


def range_of(texts: Texts, stretch: Stretch | Edit) -> lsp.Range:
    """The range of a stretch of a file."""
    source = texts.project.source(stretch.path)
    length = len(source.text)
    ends = (
        texts.columns.position_at(source, min(at, length)) for at in (stretch.start, stretch.end)
    )
    start, end = (lsp.Position(end.line, end.character) for end in ends)
    return lsp.Range(start, end)


def location(texts: Texts, stretch: Stretch) -> lsp.Location:
    """The place of a stretch."""
    return lsp.Location(texts.uri(stretch.path), range_of(texts, stretch))


def diagnostics(texts: Texts, notes: Iterable[Note]) -> list[lsp.Diagnostic]:
    """Notes with their ranges, codes and ways out."""
    return [_diagnostic(texts, note) for note in notes]


def _diagnostic(texts: Texts, note: Note) -> lsp.Diagnostic:
    found = note.diagnostic
    return lsp.Diagnostic(
        range=range_of(texts, note.where),
        message=f"{found.message}\n{found.help}" if found.help else found.message,
        severity=_SEVERITIES[found.severity],
        code=found.code,
        source="specc",
        related_information=[
            lsp.DiagnosticRelatedInformation(location(texts, where), message)
            for where, message in note.related
        ],
    )


def hover(texts: Texts, found: Hover | None) -> lsp.Hover | None:
    """Markdown with its range."""
    if found is None:
        return None
    content = lsp.MarkupContent(lsp.MarkupKind.Markdown, found.text)
    return lsp.Hover(content, range_of(texts, found.where))


def completions(
    texts: Texts, path: str, offset: int, found: Iterable[Completion]
) -> lsp.CompletionList:
    """Items that replace the word before the cursor."""
    return lsp.CompletionList(
        is_incomplete=False, items=[_item(texts, path, offset, item) for item in found]
    )


def _item(texts: Texts, path: str, offset: int, found: Completion) -> lsp.CompletionItem:
    item = found.item
    where = range_of(texts, Stretch(path, offset - found.replaces, offset))
    words = lsp.MarkupContent(lsp.MarkupKind.Markdown, item.words) if item.words else None
    return lsp.CompletionItem(
        label=item.label,
        kind=_KINDS.get(item.kind, lsp.CompletionItemKind.Reference),
        detail=f"{item.kind} {item.detail}".strip(),
        documentation=words,
        text_edit=lsp.TextEdit(where, item.label + found.suffix),
    )


def workspace_edit(texts: Texts, edits: Iterable[Edit], new: str) -> lsp.WorkspaceEdit:
    """The same new name in all stretches."""
    changes: dict[str, list[lsp.TextEdit]] = {}
    for edit in edits:
        text_edit = lsp.TextEdit(range_of(texts, edit), new)
        changes.setdefault(texts.uri(edit.path), []).append(text_edit)
    return lsp.WorkspaceEdit(changes=changes)
