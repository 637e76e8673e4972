"""Findings, places and symbols in the terms of the protocol; positions in texts."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from lsprotocol import types as lsp

from specc.reachable import grouped
from specc.source import SourceFile
from specc.tools.lsp.actions import Action
from specc.tools.lsp.answers import Hover, Note
from specc.tools.lsp.completion import Completion
from specc.tools.lsp.describe import OutlineEntry
from specc.tools.lsp.project import FileEdit, Project, Stretch
from specc.tools.lsp.signature import CallSignature
from specc.tools.lsp.unfinished import difference

# Offsets into a text and positions of the protocol, whose columns count code units.
#
# The protocol counts UTF-16 code units unless client and server agree on another encoding.


_CODECS = {
    "utf-8": ("utf-8", 1),
    "utf-16": ("utf-16-le", 2),
    "utf-32": ("utf-32-le", 4),
}


@dataclass(frozen=True, slots=True)
class Columns:
    """Converts offsets and positions in the encoding that was agreed on."""

    encoding: str = "utf-16"

    def position_at(self, source: SourceFile, offset: int) -> lsp.Position:
        """The position of a character of a text."""
        line = bisect_right(source.line_starts, offset) - 1
        return lsp.Position(line, self._units(source.text[source.line_starts[line] : offset]))

    def offset_at(self, source: SourceFile, position: lsp.Position) -> int:
        """The character at a position; what is beyond the text or its line is its end."""
        if position.line >= len(source.line_starts):
            return len(source.text)
        start, line = source.line_starts[max(position.line, 0)], source.lines[max(position.line, 0)]
        if line.isascii():
            return start + min(max(position.character, 0), len(line))
        left = position.character
        for index, char in enumerate(line):
            left -= self._units(char)
            if left < 0:
                return start + index
        return start + len(line)

    def _units(self, text: str) -> int:
        codec, size = _CODECS.get(self.encoding, _CODECS["utf-16"])
        return len(text) if text.isascii() else len(text.encode(codec, "surrogatepass")) // size


# Values of `specc.tools.lsp.answers` as those of the protocol.


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
    "interface": lsp.CompletionItemKind.Interface,
    "unit": lsp.CompletionItemKind.Unit,
    "file": lsp.CompletionItemKind.File,
    "clock": lsp.CompletionItemKind.Keyword,
    "subsystem": lsp.CompletionItemKind.Module,
    "inputs": lsp.CompletionItemKind.Module,
}

_SYMBOLS = {
    "agent": lsp.SymbolKind.Module,
    "subsystem": lsp.SymbolKind.Class,
    "device": lsp.SymbolKind.Interface,
    "type": lsp.SymbolKind.Struct,
    "interface": lsp.SymbolKind.Interface,
    "field": lsp.SymbolKind.Field,
    "element": lsp.SymbolKind.Field,
    "constant": lsp.SymbolKind.Constant,
    "parameter": lsp.SymbolKind.Constant,
    "frame": lsp.SymbolKind.Namespace,
    "file": lsp.SymbolKind.File,
    "operator": lsp.SymbolKind.Function,
    "memory": lsp.SymbolKind.Variable,
    "let": lsp.SymbolKind.Variable,
    "initial condition": lsp.SymbolKind.Boolean,
    "terminal condition": lsp.SymbolKind.Boolean,
    "error condition": lsp.SymbolKind.Boolean,
    "function": lsp.SymbolKind.Method,
    "behaviour": lsp.SymbolKind.Method,
    "state": lsp.SymbolKind.EnumMember,
}


@dataclass(frozen=True, slots=True)
class Texts:
    """The present texts, the way the client counts in them, and the URIs of paths."""

    project: Project
    columns: Columns
    uri: Callable[[str], str]


def range_of(texts: Texts, stretch: Stretch) -> lsp.Range:
    """The range of a stretch of a file."""
    source = texts.project.source(stretch.path)
    ends = (min(at, len(source.text)) for at in (stretch.start, stretch.end))
    return lsp.Range(*(texts.columns.position_at(source, end) for end in ends))


def location(texts: Texts, stretch: Stretch) -> lsp.Location:
    """The place of a stretch."""
    return lsp.Location(texts.uri(stretch.path), range_of(texts, stretch))


def diagnostic(texts: Texts, note: Note) -> lsp.Diagnostic:
    """A note with its range, code and ways out."""
    found = note.diagnostic
    return lsp.Diagnostic(
        range=range_of(texts, note.where),
        message="\n".join((found.message, *found.remarks)),
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


def symbols(texts: Texts, path: str, entries: Iterable[OutlineEntry]) -> list[lsp.DocumentSymbol]:
    """The outline of a file."""
    return [
        lsp.DocumentSymbol(
            name=entry.name,
            detail=entry.title or entry.kind,
            kind=_SYMBOLS.get(entry.kind, lsp.SymbolKind.Property),
            range=range_of(texts, Stretch(path, entry.start, entry.end)),
            selection_range=range_of(texts, Stretch(path, entry.name_start, entry.name_end)),
            children=symbols(texts, path, entry.inside),
        )
        for entry in entries
    ]


def signature_help(found: CallSignature | None) -> lsp.SignatureHelp | None:
    """One signature with the argument that is being written."""
    if found is None:
        return None
    parameters = [lsp.ParameterInformation(label) for label in found.parameters]
    shown = lsp.SignatureInformation(found.label, found.words or None, parameters)
    return lsp.SignatureHelp([shown], 0, found.active)


def code_action(texts: Texts, action: Action) -> lsp.CodeAction:
    """A repair as edits, with the finding that it is about."""
    return lsp.CodeAction(
        title=action.title,
        kind=lsp.CodeActionKind.QuickFix,
        is_preferred=action.preferred,
        edit=workspace_edit(texts, action.changes),
    )


def whole(texts: Texts, path: str, text: str | None) -> list[lsp.TextEdit]:
    """Another text for all of a file, as the lines that differ."""
    if text is None:
        return []
    moved = difference(texts.project.source(path).text, text)
    where = range_of(texts, Stretch(path, moved.start, moved.old_end))
    return [lsp.TextEdit(where, text[moved.start : moved.new_end])]


def completions(
    texts: Texts, path: str, offset: int, found: Iterable[Completion]
) -> lsp.CompletionList:
    """Items that replace the word before the cursor."""
    return lsp.CompletionList(
        is_incomplete=False,
        items=[_item(texts, path, offset, item, rank) for rank, item in enumerate(found)],
    )


def _item(texts: Texts, path: str, offset: int, item: Completion, rank: int) -> lsp.CompletionItem:
    where = range_of(texts, Stretch(path, offset - item.replaces, offset))
    words = lsp.MarkupContent(lsp.MarkupKind.Markdown, item.words) if item.words else None
    return lsp.CompletionItem(
        label=item.label,
        kind=_KINDS.get(item.kind, lsp.CompletionItemKind.Reference),
        detail=f"{item.kind} {item.detail}".strip(),
        documentation=words,
        sort_text=f"{rank:05}",
        filter_text=item.label,
        text_edit=lsp.TextEdit(where, item.label + item.suffix),
    )


def workspace_edit(texts: Texts, edits: Iterable[FileEdit]) -> lsp.WorkspaceEdit:
    """Edits by the files that they are of."""
    made = ((texts.uri(e.path), lsp.TextEdit(range_of(texts, e), e.text)) for e in edits)
    return lsp.WorkspaceEdit(changes=grouped(made))
