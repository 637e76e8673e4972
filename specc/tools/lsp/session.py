"""The features in the terms of the protocol: URIs, positions, and its classes of answers.

Everything here may take long; it runs in a process that the server can end: see `worker`.
"""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from lsprotocol import types as lsp
from pygls import uris
from pygls.workspace import PositionCodec

from specc.reachable import grouped
from specc.resources import library_name, on_disk
from specc.source import SourceFile
from specc.tools.lsp import features
from specc.tools.lsp.describe import OutlineEntry
from specc.tools.lsp.features import Note
from specc.tools.lsp.project import FileEdit, Project, TextRange
from specc.tools.lsp.unfinished import shift

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
    "mode": lsp.SymbolKind.Enum,
}


class PositionParams(Protocol):
    """A question about a place in a text."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


@dataclass(frozen=True, slots=True)
class ClientState:
    """What a client has open: texts by URI, and folders; and how it counts columns."""

    encoding: str
    folders: tuple[str, ...]
    texts: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Positions:
    """Converts offsets into a text and positions, whose columns count code units."""

    encoding: str = "utf-16"

    def position_at(self, source: SourceFile, offset: int) -> lsp.Position:
        """The position of a character of a text."""
        offset = min(offset, len(source.text))
        line = bisect_right(source.line_starts, offset) - 1
        before = source.text[source.line_starts[line] : offset]
        return lsp.Position(line, PositionCodec(self.encoding).client_num_units(before))

    def offset_at(self, source: SourceFile, position: lsp.Position) -> int:
        """The character at a position; what is beyond the text or its line is its end."""
        if position.line >= len(source.line_starts):
            return len(source.text)
        lines = [source.lines[position.line] + "\n"]
        codec, in_line = PositionCodec(self.encoding), lsp.Position(0, position.character)
        column = codec.position_from_client_units(lines, in_line).character
        return source.line_starts[position.line] + column


@dataclass(eq=False, slots=True)
class EditorSession:
    """The project of an editor."""

    project: Project = field(default_factory=Project)
    positions: Positions = field(default_factory=Positions)
    _uris: dict[str, str] = field(default_factory=dict)

    def answer(self, client: ClientState, feature: str, params: Any) -> Any:
        """The result of a method of this class, for the present texts."""
        self._update(client)
        return getattr(self, feature)(params)

    def _update(self, client: ClientState) -> None:
        self.project.folders = client.folders
        self.positions = Positions(client.encoding)
        texts = {self.path(uri): text for uri, text in client.texts.items()}
        for path in self.project.open_paths() - texts.keys():
            self.project.close(path)
        for path, text in texts.items():
            self.project.put(path, text)

    def analyse(
        self, client: ClientState, changed: str, search: bool, reported: set[str]
    ) -> dict[str, list[lsp.Diagnostic]]:
        """Analyse the systems that read a changed file; the diagnostics to publish, by URI.

        `search` looks for these systems on the disk; `reported` files have diagnostics already.
        """
        self._update(client)
        project, path = self.project, self.path(changed)
        project.forget_deleted(path)
        if project.is_specification(path) or project.is_used(path):
            for root in project.find_roots(path, search):
                project.analyse(root)
        found = features.notes(project)
        before = set(map(self.path, reported))
        return {
            self.uri(file): [self._diagnostic(note) for note in found.get(file, ())]
            for file in sorted({*found, *before, path})
            if found.get(file) or file in before | project.open_paths()
        }

    def hover(self, params: lsp.HoverParams) -> lsp.Hover | None:
        """What is known of a place."""
        found = features.hover(self.project, *self._place(params))
        if found is None:
            return None
        content = lsp.MarkupContent(lsp.MarkupKind.Markdown, found.text)
        return lsp.Hover(content, self._range(found.range))

    def definition(self, params: lsp.DefinitionParams) -> list[lsp.Location]:
        """Where a name is declared."""
        return list(map(self._location, features.definition(self.project, *self._place(params))))

    def references(self, params: lsp.ReferenceParams) -> list[lsp.Location]:
        """Where a name stands."""
        declarations = params.context.include_declaration
        place = self._place(params)
        found = features.references(self.project, *place, declarations=declarations)
        return list(map(self._location, found))

    def completion(self, params: lsp.CompletionParams) -> lsp.CompletionList:
        """What can stand at a place, in place of the word before it."""
        path, offset = self._place(params)
        items = []
        for rank, item in enumerate(features.completions(self.project, path, offset)):
            where = self._range(TextRange(path, offset - item.replaces, offset))
            words = lsp.MarkupContent(lsp.MarkupKind.Markdown, item.words) if item.words else None
            items.append(
                lsp.CompletionItem(
                    label=item.label,
                    kind=_KINDS.get(item.kind, lsp.CompletionItemKind.Reference),
                    detail=f"{item.kind} {item.detail}".strip(),
                    documentation=words,
                    sort_text=f"{rank:05}",
                    filter_text=item.label,
                    text_edit=lsp.TextEdit(where, item.label + item.suffix),
                )
            )
        return lsp.CompletionList(is_incomplete=False, items=items)

    def symbols(self, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        """The outline of a file."""
        path = self.path(params.text_document.uri)
        return self._symbols(path, features.outline(self.project, path))

    def formatting(self, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        """The edits that give a file the canonical layout."""
        path = self.path(params.text_document.uri)
        old, new = self.project.source(path).text, features.layout(self.project, path)
        changes = shift(old, new).changes() if new is not None else ()
        return [
            lsp.TextEdit(self._range(TextRange(path, before.start, before.stop)), new[after])
            for before, after in changes
            if new is not None
        ]

    def repairs(self, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        """What can be done about the findings of a range."""
        path, start = self._offset(params.text_document, params.range.start)
        _, end = self._offset(params.text_document, params.range.end)
        return [
            lsp.CodeAction(
                title=action.title,
                kind=lsp.CodeActionKind.QuickFix,
                is_preferred=action.preferred,
                edit=self._workspace_edit(action.changes),
            )
            for action in features.repairs(self.project, path, start, end)
        ]

    def signature(self, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        """The call that is being written at a place, with its active argument."""
        found = features.signature_at(self.project, *self._place(params))
        if found is None:
            return None
        parameters = [lsp.ParameterInformation(label) for label in found.parameters]
        shown = lsp.SignatureInformation(found.label, found.words or None, parameters)
        return lsp.SignatureHelp([shown], 0, found.active)

    def highlights(self, params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        """Where a name stands in its own file."""
        path, offset = self._place(params)
        found = features.references(self.project, path, offset)
        return [lsp.DocumentHighlight(self._range(each)) for each in found if each.path == path]

    def renameable(self, params: lsp.PrepareRenameParams) -> lsp.Range | None:
        """The name at a place; raises `RenameError` where it cannot be changed."""
        found = features.renameable(self.project, *self._place(params))
        return self._range(found) if found else None

    def rename(self, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        """The edits that rename a thing; raises `RenameError`."""
        edits = features.rename_at(self.project, *self._place(params), params.new_name)
        return self._workspace_edit(edits)

    # URIs and positions.

    def path(self, uri: str) -> str:
        """The path of a document; one that is not on the disk is known by its URI."""
        path = uris.to_fs_path(uri) if uri.startswith("file:") else None
        path = library_name(os.path.normpath(path)) if path else uri
        self._uris.setdefault(path, uri)
        return path

    def uri(self, path: str) -> str:
        """The URI of a path, as the client spells it if it has the file open."""
        return self._uris.get(path) or uris.from_fs_path(on_disk(path)) or path

    def _place(self, params: PositionParams) -> tuple[str, int]:
        return self._offset(params.text_document, params.position)

    def _offset(
        self, document: lsp.TextDocumentIdentifier, position: lsp.Position
    ) -> tuple[str, int]:
        path = self.path(document.uri)
        return path, self.positions.offset_at(self.project.source(path), position)

    def _range(self, where: TextRange) -> lsp.Range:
        source = self.project.source(where.path)
        ends = (self.positions.position_at(source, at) for at in (where.start, where.end))
        return lsp.Range(*ends)

    def _location(self, where: TextRange) -> lsp.Location:
        return lsp.Location(self.uri(where.path), self._range(where))

    def _diagnostic(self, note: Note) -> lsp.Diagnostic:
        found = note.diagnostic
        return lsp.Diagnostic(
            range=self._range(note.range),
            message="\n".join((found.message, *found.remarks)),
            severity=_SEVERITIES[found.severity],
            code=found.code,
            source="specc",
            related_information=[
                lsp.DiagnosticRelatedInformation(self._location(where), message)
                for where, message in note.related
            ],
        )

    def _symbols(self, path: str, entries: Iterable[OutlineEntry]) -> list[lsp.DocumentSymbol]:
        return [
            lsp.DocumentSymbol(
                name=entry.name,
                detail=entry.title or entry.kind,
                kind=_SYMBOLS.get(entry.kind, lsp.SymbolKind.Property),
                range=self._range(TextRange(path, entry.start, entry.end)),
                selection_range=self._range(TextRange(path, entry.name_start, entry.name_end)),
                children=self._symbols(path, entry.children),
            )
            for entry in entries
        ]

    def _workspace_edit(self, edits: Iterable[FileEdit]) -> lsp.WorkspaceEdit:
        changes = ((self.uri(e.path), lsp.TextEdit(self._range(e), e.text)) for e in edits)
        return lsp.WorkspaceEdit(changes=grouped(changes))
