"""The language server: requests of the protocol in, answers of `specc.lsp.answers` out."""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import time

from lsprotocol import types as lsp
from pygls import uris
from pygls.exceptions import JsonRpcInvalidRequest
from pygls.lsp.server import LanguageServer

from specc import __version__
from specc.lsp import answers, convert, services
from specc.lsp.convert import Texts
from specc.lsp.positions import Columns
from specc.lsp.project import Project
from specc.lsp.rename import RenameError

_LOG = logging.getLogger(__name__)

PAUSE_S, LONGEST_PAUSE_S = 0.02, 1.0
"""Pause in typing after which a text is analysed."""
QUICK_S = 0.2
"""An analysis that takes longer waits as long as it took, so that typing stays smooth."""
WATCH_S = 3.0
"""How often it is looked whether the client is still there."""


class SpecServer(LanguageServer):
    """The project of an editor, and what was told to it."""

    def __init__(self) -> None:
        super().__init__(
            "specc", __version__, text_document_sync_kind=lsp.TextDocumentSyncKind.Full
        )
        self.project = Project()
        self._uris: dict[str, str] = {}
        self._changed: dict[str, bool] = {}
        self._told: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None
        self._took_s = 0.0
        self.said_goodbye = False
        self.left_without_goodbye = False

    @property
    def texts(self) -> Texts:
        """The texts as the client counts in them."""
        return Texts(self.project, Columns(str(self.workspace.position_encoding)), self.uri)

    def path(self, uri: str) -> str:
        """The path of a document; one that is not on the disk is known by its URI."""
        path = uris.to_fs_path(uri) if uri.startswith("file:") else None
        path = os.path.normpath(path) if path else uri
        self._uris.setdefault(path, uri)
        return path

    def uri(self, path: str) -> str:
        """The URI of a path, as the client spells it if it has the file open."""
        return self._uris.get(path) or uris.from_fs_path(path) or path

    def take(self, uri: str, text: str | None, search: bool = False) -> None:
        """Take a text that was opened, changed or (with None) closed, and analyse it soon."""
        path = self.path(uri)
        if text is None:
            self.project.close(path)
        else:
            self.project.put(path, text)
        self.plan(path, search)

    def plan(self, path: str, search: bool = False) -> None:
        """Analyse a file after a pause; a change in the pause begins it anew."""
        self._changed[path] = search or self._changed.get(path, False)
        if self._timer is not None:
            self._timer.cancel()
        pause = PAUSE_S if self._took_s < QUICK_S else min(self._took_s, LONGEST_PAUSE_S)
        self._timer = asyncio.get_running_loop().call_later(pause, self._analyse)

    def _folders(self) -> tuple[str, ...]:
        """The folders of the client; older ones have a single root instead."""
        folders = [uris.to_fs_path(uri) for uri in self.workspace.folders]
        return tuple(filter(None, folders or [self.workspace.root_path]))

    def _analyse(self) -> None:
        """Analyse what has changed and tell the client; a fault of ours must not end the server."""
        changed, self._changed = self._changed, {}
        started = time.perf_counter()
        try:
            self.project.folders = self._folders()
            for path, search in changed.items():
                self.project.forget_deleted(path)
                if self.project.is_specification(path) or self.project.is_used(path):
                    for root in self.project.roots(path, search):
                        self.project.analyse(root)
            self._tell(set(changed))
        except Exception:  # noqa: BLE001 - the next text may be one that specc can deal with
            _LOG.exception("a fault of specc itself, not of your files")
        self._took_s = time.perf_counter() - started

    def _tell(self, changed: set[str]) -> None:
        found = answers.notes(self.project)
        texts = self.texts
        for path in sorted({*found, *changed, *self._told}):
            notes = found.get(path, [])
            if not notes and path not in self._told and not self.project.is_open(path):
                continue
            document = self.workspace.text_documents.get(self.uri(path))
            self.text_document_publish_diagnostics(
                lsp.PublishDiagnosticsParams(
                    self.uri(path),
                    convert.diagnostics(texts, notes),
                    document.version if document else None,
                )
            )
            (self._told.add if notes else self._told.discard)(path)


def create_server() -> SpecServer:
    """A server with all its features."""
    server = SpecServer()
    _follow_client(server)
    _follow_texts(server)
    _answer_questions(server)
    _serve_files(server)
    _rename(server)
    return server


def _follow_client(server: SpecServer) -> None:
    @server.feature(lsp.INITIALIZE)
    def initialize(params: lsp.InitializeParams) -> None:
        # In a container the client may be a process that cannot be seen from here.
        if params.process_id and os.name == "posix" and _lives(params.process_id):
            _watch(params.process_id)

    @server.feature(lsp.SHUTDOWN)
    def shutdown(params: None) -> None:
        server.said_goodbye = True

    @server.feature(lsp.EXIT)
    def leave(params: None) -> None:
        server.left_without_goodbye = not server.said_goodbye


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        pass  # it is somebody else's
    return True


def _watch(process: int) -> None:
    """End with the process of the client, whose pipe somebody else may keep open."""
    if not _lives(process):
        # The thread that reads waits for a pipe that may never close.
        os._exit(1)
    asyncio.get_running_loop().call_later(WATCH_S, _watch, process)


def _follow_texts(server: SpecServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    def opened(params: lsp.DidOpenTextDocumentParams) -> None:
        server.take(params.text_document.uri, params.text_document.text, search=True)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: lsp.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        server.take(uri, server.workspace.get_text_document(uri).source)

    @server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)
    def saved(params: lsp.DidSaveTextDocumentParams) -> None:
        server.plan(server.path(params.text_document.uri), search=True)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: lsp.DidCloseTextDocumentParams) -> None:
        server.take(params.text_document.uri, None)

    @server.feature(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def watched(params: lsp.DidChangeWatchedFilesParams) -> None:
        for event in params.changes:
            server.plan(server.path(event.uri))


def _answer_questions(server: SpecServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_HOVER)
    def hover(params: lsp.HoverParams) -> lsp.Hover | None:
        path, offset = _asked(server, params.text_document, params.position)
        return convert.hover(server.texts, answers.hover(server.project, path, offset))

    @server.feature(lsp.TEXT_DOCUMENT_DEFINITION)
    def definition(params: lsp.DefinitionParams) -> list[lsp.Location]:
        path, offset = _asked(server, params.text_document, params.position)
        found = answers.definition(server.project, path, offset)
        return [convert.location(server.texts, stretch) for stretch in found]

    @server.feature(lsp.TEXT_DOCUMENT_REFERENCES)
    def references(params: lsp.ReferenceParams) -> list[lsp.Location]:
        path, offset = _asked(server, params.text_document, params.position)
        declarations = params.context.include_declaration
        found = answers.references(server.project, path, offset, declarations)
        return [convert.location(server.texts, stretch) for stretch in found]

    @server.feature(
        lsp.TEXT_DOCUMENT_COMPLETION,
        lsp.CompletionOptions(trigger_characters=[".", "[", "(", "{", ",", " "]),
    )
    def completion(params: lsp.CompletionParams) -> lsp.CompletionList:
        path, offset = _asked(server, params.text_document, params.position)
        found = answers.completions(server.project, path, offset)
        return convert.completions(server.texts, path, offset, found)


def _serve_files(server: SpecServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def symbols(params: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        path = server.path(params.text_document.uri)
        return convert.symbols(server.texts, path, services.outline(server.project, path))

    @server.feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def formatting(params: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        path = server.path(params.text_document.uri)
        return convert.whole(server.texts, path, services.layout(server.project, path))

    @server.feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION, lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix])
    )
    def repairs(params: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        path, start = _asked(server, params.text_document, params.range.start)
        _, end = _asked(server, params.text_document, params.range.end)
        found = services.repairs(server.project, path, start, end)
        return [convert.code_action(server.texts, action) for action in found]

    @server.feature(
        lsp.TEXT_DOCUMENT_SIGNATURE_HELP, lsp.SignatureHelpOptions(trigger_characters=["(", ","])
    )
    def signature(params: lsp.SignatureHelpParams) -> lsp.SignatureHelp | None:
        path, offset = _asked(server, params.text_document, params.position)
        return convert.signature_help(services.signature_at(server.project, path, offset))

    @server.feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlights(params: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        path, offset = _asked(server, params.text_document, params.position)
        found = answers.references(server.project, path, offset, True)
        own = (stretch for stretch in found if stretch.path == path)
        return [lsp.DocumentHighlight(convert.range_of(server.texts, s)) for s in own]


def _rename(server: SpecServer) -> None:
    @server.feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare(params: lsp.PrepareRenameParams) -> lsp.Range | None:
        path, offset = _asked(server, params.text_document, params.position)
        try:
            found = answers.renameable(server.project, path, offset)
        except RenameError as error:
            raise JsonRpcInvalidRequest(str(error)) from None
        return convert.range_of(server.texts, found) if found else None

    @server.feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    def rename(params: lsp.RenameParams) -> lsp.WorkspaceEdit:
        path, offset = _asked(server, params.text_document, params.position)
        try:
            edits = answers.rename_at(server.project, path, offset, params.new_name)
        except RenameError as error:
            raise JsonRpcInvalidRequest(str(error)) from None
        return convert.workspace_edit(server.texts, edits, params.new_name)


def _asked(
    server: SpecServer, document: lsp.TextDocumentIdentifier, position: lsp.Position
) -> tuple[str, int]:
    path = server.path(document.uri)
    return path, convert.offset(server.texts, path, position)


def serve() -> int:
    """Speak with a client over standard input and output until it ends; the code to exit with."""
    # The protocol owns standard output: what anything else prints goes to standard error.
    output = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    logging.basicConfig(level=logging.WARNING)
    logging.getLogger("pygls.protocol.json_rpc").addFilter(_is_fault)
    server = create_server()
    server.start_io(stdout=output)
    return 1 if server.left_without_goodbye else 0


def _is_fault(record: logging.LogRecord) -> bool:
    """Whether a record is more than the refusal of a request, which the client shows."""
    error = record.exc_info[1] if record.exc_info else None
    return not isinstance(error, JsonRpcInvalidRequest)
