"""What the server does with texts and questions, away from the loop that speaks with the client.

Everything here may take long; it runs in a process that the server can end: see `worker`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Protocol

from lsprotocol import types as lsp

from specc.resources import library_name, on_disk
from specc.tools.lsp import actions, answers, convert
from specc.tools.lsp.convert import Columns, Texts
from specc.tools.lsp.project import Project


class Asked(Protocol):
    """A question about a place in a text."""

    text_document: lsp.TextDocumentIdentifier
    position: lsp.Position


class Desk:
    """The project of an editor; questions come and answers go as the protocol has them."""

    def __init__(
        self, to_path: Callable[[str], str | None], to_uri: Callable[[str], str | None]
    ) -> None:
        self._project = Project()
        self._encoding = "utf-16"
        self._to_path, self._to_uri = to_path, to_uri
        self._uris: dict[str, str] = {}

    @property
    def _texts(self) -> Texts:
        """The texts as the client counts in them."""
        return Texts(self._project, Columns(self._encoding), self._uri)

    def _path(self, uri: str) -> str:
        """The path of a document; one that is not on the disk is known by its URI."""
        path = self._to_path(uri) if uri.startswith("file:") else None
        path = library_name(os.path.normpath(path)) if path else uri
        self._uris.setdefault(path, uri)
        return path

    def _uri(self, path: str) -> str:
        """The URI of a path, as the client spells it if it has the file open."""
        return self._uris.get(path) or self._to_uri(on_disk(path)) or path

    def _asked(self, params: Asked) -> tuple[str, int]:
        return self._at(params.text_document, params.position)

    def _at(self, document: lsp.TextDocumentIdentifier, position: lsp.Position) -> tuple[str, int]:
        path = self._path(document.uri)
        return path, self._texts.columns.offset_at(self._project.source(path), position)

    def begin(self, encoding: str) -> None:
        """Count columns as the client does."""
        self._encoding = encoding

    def take(self, uri: str, text: str | None) -> None:
        """Take a text that was opened, changed or (with None) closed."""
        path = self._path(uri)
        if text is None:
            self._project.close(path)
        else:
            self._project.put(path, text)

    def analyse(
        self, changed: dict[str, bool], folders: tuple[str, ...], told: set[str]
    ) -> dict[str, list[lsp.Diagnostic]]:
        """Analyse what has changed; returns what to report now, by URI; `told` was reported before.

        `changed` says of each URI whether the systems that use it are looked for on the disk.
        """
        project = self._project
        project.folders = folders
        for path, search in ((self._path(uri), search) for uri, search in changed.items()):
            project.forget_deleted(path)
            if project.is_specification(path) or project.is_used(path):
                for root in project.roots(path, search):
                    project.analyse(root)
        found = answers.notes(project)
        before = {self._path(uri) for uri in told}
        shown = {*found, *before, *map(self._path, changed)}
        return {
            self._uri(path): [convert.diagnostic(self._texts, note) for note in found.get(path, ())]
            for path in sorted(shown)
            if found.get(path) or path in before or project.is_open(path)
        }

    def hover(self, params: lsp.HoverParams) -> lsp.Hover | None:
        """What is known of a place."""
        return convert.hover(self._texts, answers.hover(self._project, *self._asked(params)))

    def definition(self, params: lsp.DefinitionParams) -> list[lsp.Location]:
        """Where a name is declared."""
        found = answers.definition(self._project, *self._asked(params))
        return [convert.location(self._texts, stretch) for stretch in found]

    def references(self, params: lsp.ReferenceParams) -> list[lsp.Location]:
        """Where a name stands."""
        declarations = params.context.include_declaration
        found = answers.references(self._project, *self._asked(params), declarations)
        return [convert.location(self._texts, stretch) for stretch in found]

    def completion(self, params: lsp.CompletionParams) -> lsp.CompletionList:
        """What can stand at a place."""
        path, offset = self._asked(params)
        found = answers.completions(self._project, path, offset)
        return convert.completions(self._texts, path, offset, found)

    def symbols(self, params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        """The outline of a file."""
        path = self._path(params.text_document.uri)
        return convert.symbols(self._texts, path, actions.outline(self._project, path))

    def formatting(self, params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        """The canonical layout of a file."""
        path = self._path(params.text_document.uri)
        return convert.whole(self._texts, path, actions.layout(self._project, path))

    def repairs(self, params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        """What can be done about the findings of a stretch."""
        path, start = self._at(params.text_document, params.range.start)
        _, end = self._at(params.text_document, params.range.end)
        found = actions.repairs(self._project, path, start, end)
        return [convert.code_action(self._texts, action) for action in found]

    def signature(self, params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        """The call that is being written at a place."""
        return convert.signature_help(actions.signature_at(self._project, *self._asked(params)))

    def highlights(self, params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        """Where a name stands in its own file."""
        path, offset = self._asked(params)
        found = answers.references(self._project, path, offset, True)
        own = (stretch for stretch in found if stretch.path == path)
        return [lsp.DocumentHighlight(convert.range_of(self._texts, s)) for s in own]

    def renameable(self, params: lsp.PrepareRenameParams) -> lsp.Range | None:
        """The name at a place; raises `RenameError` where it cannot be changed."""
        found = answers.renameable(self._project, *self._asked(params))
        return convert.range_of(self._texts, found) if found else None

    def rename(self, params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        """The edits that rename a thing; raises `RenameError`."""
        edits = answers.rename_at(self._project, *self._asked(params), params.new_name)
        return convert.workspace_edit(self._texts, edits)
