"""The language server: requests of the protocol in, answers of another process out.

The loop that speaks with the client does nothing that can take long: texts and questions go to a
`Desk` in a process of its own, which is ended when its text is no longer the present one.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import time
from collections.abc import Iterator
from typing import Any, BinaryIO, cast

from lsprotocol import types as lsp
from pygls import uris
from pygls.exceptions import (
    JsonRpcContentModified,
    JsonRpcInternalError,
    JsonRpcInvalidParams,
    JsonRpcInvalidRequest,
)
from pygls.lsp.server import LanguageServer

from specc import __version__
from specc.tools.lsp.desk import Desk
from specc.tools.lsp.protocol import Incoming, SpecProtocol, is_fault, unreadable
from specc.tools.lsp.rename import RenameError
from specc.tools.lsp.worker import (
    Job,
    JobAbandonedError,
    JobFailedError,
    JobGivenUpError,
    MethodCall,
    Worker,
)

_LOG = logging.getLogger(__name__)

PAUSE_S, LONGEST_PAUSE_S = 0.001, 1.0
"""Pause in typing after which a text is analysed."""
QUICK_S = 0.5
"""An analysis that takes longer waits as long as it took, so that typing stays smooth."""
PATIENCE_S = 1.0
"""An analysis of a text that has changed is ended when it has taken so long."""
WATCH_S = 3.0
"""How often it is looked whether the client is still there."""

QUESTIONS: dict[str, tuple[str, Any]] = {
    lsp.TEXT_DOCUMENT_HOVER: ("hover", None),
    lsp.TEXT_DOCUMENT_DEFINITION: ("definition", None),
    lsp.TEXT_DOCUMENT_REFERENCES: ("references", None),
    lsp.TEXT_DOCUMENT_COMPLETION: (
        "completion",
        lsp.CompletionOptions(trigger_characters=[".", "[", "(", "{", ",", " "]),
    ),
    lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL: ("symbols", None),
    lsp.TEXT_DOCUMENT_FORMATTING: ("formatting", None),
    lsp.TEXT_DOCUMENT_CODE_ACTION: (
        "repairs",
        lsp.CodeActionOptions([lsp.CodeActionKind.QuickFix]),
    ),
    lsp.TEXT_DOCUMENT_SIGNATURE_HELP: (
        "signature",
        lsp.SignatureHelpOptions(trigger_characters=["(", ","]),
    ),
    lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT: ("highlights", None),
    lsp.TEXT_DOCUMENT_PREPARE_RENAME: ("renameable", None),
    lsp.TEXT_DOCUMENT_RENAME: ("rename", lsp.RenameOptions(prepare_provider=True)),
}
"""Methods of the protocol, those of `Desk` that answer them, and how they are announced."""


def make_desk() -> Desk:
    """The desk of a new process."""
    return Desk(uris.to_fs_path, uris.from_fs_path)


class SpecServer(LanguageServer):
    """What was told to the client, and what is still to be analysed."""

    def __init__(self) -> None:
        super().__init__(
            "specc",
            __version__,
            text_document_sync_kind=lsp.TextDocumentSyncKind.Full,
            protocol_cls=SpecProtocol,
        )
        self.worker = Worker(make_desk, self._first_calls, (RenameError,))
        self._changed: dict[str, bool] = {}
        self._told: set[str] = set()
        self._alone: list[str] = []
        """Files to be analysed one by one, to find out which of them ended the process."""
        self._given_up: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None
        self._check: Job | None = None
        self._took_s = 0.0
        self.said_goodbye = False
        self.left_without_goodbye = False

    def _first_calls(self) -> Iterator[MethodCall]:
        """What a new process has to know."""
        yield "begin", (str(self.workspace.position_encoding),)
        for document in self.workspace.text_documents.values():
            yield "take", (document.uri, document.source)

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Tell the client about an error that no answer reports."""
        refusal = unreadable(error)
        if refusal and isinstance(self.protocol, SpecProtocol):
            self.protocol.refuse(refusal)
        else:
            super().report_server_error(error, source)

    async def answer(self, name: str, params: Any) -> Any:
        """The desk's answer to a question."""
        try:
            return await self.worker.ask(name, params).result
        except RenameError as error:
            raise JsonRpcInvalidRequest(str(error)) from None
        except JobGivenUpError as why:
            self._lost()
            self._analyse()
            raise JsonRpcContentModified(f"given up, since it {why}") from None
        except JobAbandonedError:
            raise JsonRpcContentModified("given up, since checking the text takes long") from None
        except JobFailedError as error:
            raise JsonRpcInternalError(str(error)) from None

    def take(self, uri: str, text: str | None, search: bool = False) -> None:
        """Take a text that was opened, changed or (with None) closed, and analyse it soon."""
        self._given_up.discard(uri)
        self.worker.ask("take", uri, text)
        self.plan(uri, search)

    def plan(self, uri: str, search: bool = False) -> None:
        """Analyse a file after a pause; a change in the pause begins it anew."""
        self._changed[uri] = search or self._changed.get(uri, False)
        if self._timer is not None:
            self._timer.cancel()
        loop = asyncio.get_running_loop()
        pause = PAUSE_S if self._took_s < QUICK_S else min(self._took_s, LONGEST_PAUSE_S)
        self._timer = loop.call_later(pause, self._analyse)
        if (check := self._check) is not None:
            now = time.monotonic()
            left = check.started_s + PATIENCE_S - now if check.started_s is not None else 0.0
            loop.call_later(max(left, 0.0), self.worker.abandon, check)

    def _folders(self) -> tuple[str, ...]:
        """The folders of the client; older ones have a single root instead."""
        folders = [uris.to_fs_path(uri) for uri in self.workspace.folders]
        return tuple(filter(None, folders or [self.workspace.root_path]))

    def _analyse(self) -> None:
        """Have changed files analysed, or, if the desk is busy with them, once it is done."""
        if self._check is None and (self._alone or self._changed):
            if self._alone:
                changed = {self._alone.pop(): True}
            else:
                changed, self._changed = self._changed, {}
            self._check = self.worker.ask("analyse", changed, self._folders(), set(self._told))
            versions = {uri: d.version for uri, d in self.workspace.text_documents.items()}
            self._task = asyncio.ensure_future(self._checked(self._check, changed, versions))

    async def _checked(
        self, check: Job, changed: dict[str, bool], versions: dict[str, int | None]
    ) -> None:
        """Tell what an analysis finds; a fault of ours must not end the server."""
        try:
            self._tell(await check.result, versions)
        except JobGivenUpError as why:
            if len(changed) > 1:
                self._alone += changed
            else:
                self._given_up |= changed.keys()
                self._tell({uri: [_given_up(why)] for uri in changed}, versions)
            self._lost()
        except JobAbandonedError:
            if check.started_s is not None:
                self._lost()
            self._changed = changed | self._changed
        except JobFailedError as error:
            _LOG.error("a fault of specc itself, not of your files: %s", error)
        self._took_s = time.monotonic() - (check.started_s or time.monotonic())
        self._check = None
        self._analyse()

    def _lost(self) -> None:
        """Have open texts analysed anew: a new process knows nothing of them."""
        known = self._given_up.union(self._alone)
        anew = {d.uri for d in self.workspace.text_documents.values()} - known
        self._changed = dict.fromkeys(anew, True) | self._changed

    def _tell(
        self, found: dict[str, list[lsp.Diagnostic]], versions: dict[str, int | None]
    ) -> None:
        for uri, diagnostics in found.items():
            self.text_document_publish_diagnostics(
                lsp.PublishDiagnosticsParams(uri, diagnostics, versions.get(uri))
            )
            (self._told.add if diagnostics else self._told.discard)(uri)


def _given_up(why: JobGivenUpError) -> lsp.Diagnostic:
    start = lsp.Position(0, 0)
    warning = lsp.DiagnosticSeverity.Warning
    message = f"the check {why} and was given up until the text changes"
    return lsp.Diagnostic(lsp.Range(start, start), message, severity=warning, source="specc")


def create_server() -> SpecServer:
    """A server with all its features."""
    server = SpecServer()
    _follow_client(server)
    _follow_texts(server)
    for method, (name, options) in QUESTIONS.items():
        _answer(server, method, name, options)
    return server


def _answer(server: SpecServer, method: str, name: str, options: Any) -> None:
    async def answer(params: Any) -> Any:
        for position in _positions(params):
            if position.line < 0 or position.character < 0:
                raise JsonRpcInvalidParams("lines and characters count from 0")
        return await server.answer(name, params)

    server.feature(method, options)(answer)


def _positions(params: Any) -> Iterator[lsp.Position]:
    if hasattr(params, "position"):
        yield params.position
    if hasattr(params, "range"):
        yield from (params.range.start, params.range.end)


def _follow_client(server: SpecServer) -> None:
    @server.feature(lsp.INITIALIZE)
    def initialize(params: lsp.InitializeParams) -> None:
        # In a container the client may be a process that cannot be seen from here.
        if params.process_id and os.name == "posix" and _lives(params.process_id):
            _watch(params.process_id)

    @server.feature(lsp.INITIALIZED)
    def initialized(params: lsp.InitializedParams) -> None:
        # The process takes its time to begin.
        server.worker.ask("begin", str(server.workspace.position_encoding))

    @server.feature(lsp.SHUTDOWN)
    def shutdown(params: None) -> None:
        server.said_goodbye = True
        server.worker.close()

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
        server.plan(params.text_document.uri, search=True)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: lsp.DidCloseTextDocumentParams) -> None:
        server.take(params.text_document.uri, None)

    @server.feature(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def watched(params: lsp.DidChangeWatchedFilesParams) -> None:
        for event in params.changes:
            server.plan(event.uri)


def serve() -> int:
    """Speak with a client over standard input and output until it ends; the code to exit with."""
    # The protocol owns standard output: what anything else prints goes to standard error.
    output = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    logging.basicConfig(level=logging.WARNING)
    for name in ("pygls.protocol.json_rpc", "pygls.server"):
        logging.getLogger(name).addFilter(is_fault)
    server = create_server()
    try:
        server.start_io(cast(BinaryIO, Incoming(sys.stdin.buffer)), output)
    finally:
        server.worker.close()
    return 1 if server.left_without_goodbye else 0
