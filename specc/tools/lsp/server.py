"""The language server: requests of the protocol in, answers of another process out.

The loop that speaks with the client does nothing that can take long: checks and questions go to a
`EditorSession` in a process of its own, which is ended when the text of a long check has changed.
"""

from __future__ import annotations

import asyncio
import logging
import os
import re
import sys
import time
from collections.abc import Iterator
from typing import Any, BinaryIO, cast
from urllib.parse import unquote

from lsprotocol import types as lsp
from pygls import uris
from pygls.exceptions import (
    JsonRpcContentModified,
    JsonRpcException,
    JsonRpcInternalError,
    JsonRpcInvalidParams,
    JsonRpcInvalidRequest,
    JsonRpcParseError,
    JsonRpcServerNotInitialized,
)
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol

from specc import __version__
from specc.tools.lsp.rename import RenameError
from specc.tools.lsp.session import ClientState, EditorSession
from specc.tools.lsp.worker import CallFailedError, ProcessEndedError, Worker

_LOG = logging.getLogger(__name__)

# The protocol: whatever a message is, it is answered as JSON-RPC says.


MAX_MESSAGE = 16_000_000
"""Bytes; the largest text that is read has an eighth of that."""
_LONGEST_LINE = 4_096
_LENGTH = re.compile(rb"Content-Length: (\d+)\r\n\Z")
_UNREADABLE_MESSAGE = (b"Content-Length: 1\r\n", b"\r\n", b"?")


class Incoming:
    """What a client sends; a message of a length that nobody means is one that is not readable.

    What follows such a header is passed over up to the next header, wherever in a line it stands.
    """

    def __init__(self, stream: BinaryIO) -> None:
        self._stream = stream
        self._instead: list[bytes] = []

    def readline(self) -> bytes:
        """The next line of a header, or the next part of something else."""
        if self._instead:
            return self._instead.pop(0)
        line = self._stream.readline(_LONGEST_LINE)
        length = _LENGTH.search(line)
        if length is None:
            return line
        if len(length[1]) > len(str(MAX_MESSAGE)) or int(length[1]) > MAX_MESSAGE:
            first, *self._instead = _UNREADABLE_MESSAGE
            return first
        return length[0]

    def read(self, count: int) -> bytes:
        """The body of a message."""
        return self._instead.pop(0) if self._instead else self._stream.read(count)


# What a client did wrong or gave up is reported to the client, not on standard error.
_CLIENT_ERRORS = JsonRpcInvalidRequest, JsonRpcInvalidParams, JsonRpcContentModified
_UNREADABLE = ValueError, RecursionError


class SpecProtocol(LanguageServerProtocol):
    """Looks at a message as a whole before it is taken apart."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        """The data itself: pygls calls this for every object of a message."""
        return data

    def handle_message(self, message: Any) -> None:
        """Do what a message asks for; one without the form of a message is refused."""
        try:
            self._check_due(message)
            super().handle_message(self._structured(message))
        except JsonRpcException as refusal:
            self.refuse(refusal, message)

    def refuse(self, why: JsonRpcException, message: Any = None) -> None:
        """Tell the client why a message is not dealt with; a notification gets no answer."""
        if _is_message(message) and "id" not in message and "method" in message:
            return
        number = message.get("id") if isinstance(message, dict) else None
        known = number if isinstance(number, int | str) else None
        self._send_data(
            {"jsonrpc": self.VERSION, "id": known, "error": {"code": why.code, "message": str(why)}}
        )

    def _check_due(self, message: Any) -> None:
        """Raise JsonRpcException for what is no message, or does not come at its time."""
        if not _is_message(message):
            raise JsonRpcInvalidRequest("not a message of JSON-RPC 2.0")
        method = message.get("method", lsp.EXIT)
        if self._workspace is None and method not in (lsp.INITIALIZE, lsp.EXIT):
            raise JsonRpcServerNotInitialized("the first request is `initialize`")
        if self._shutdown and method != lsp.EXIT:
            raise JsonRpcInvalidRequest("the server is shutting down")

    def _structured(self, message: dict[str, Any]) -> Any:
        method = message.get("method")
        try:
            if method is not None and self.get_message_type(method) is None:
                message.setdefault("params", None)
            found = super().structure_message(message)
        except JsonRpcException:
            raise JsonRpcInvalidParams(f"not the parameters of {method}") from None
        if method == lsp.TEXT_DOCUMENT_DID_CHANGE:
            uri = unquote(found.params.text_document.uri)
            if uri not in self.workspace.text_documents:
                raise JsonRpcInvalidParams("the document is not open")
        return found


def _is_message(data: Any) -> bool:
    """Whether data are a request, a notification or an answer."""
    if not isinstance(data, dict) or data.get("jsonrpc") != SpecProtocol.VERSION:
        return False
    number = data.get("id", 0)
    if isinstance(number, bool) or not isinstance(number, int | str):
        return False
    if "method" in data:
        return isinstance(data["method"], str)
    return "id" in data and ("result" in data or "error" in data)


def _is_fault(record: logging.LogRecord) -> bool:
    """Whether what pygls logs is a fault of the server, not of its client."""
    error = record.exc_info[1] if record.exc_info else None
    if error is None:
        return record.levelno >= logging.ERROR and not record.getMessage().startswith("Unable to")
    return not isinstance(error, (*_CLIENT_ERRORS, *_UNREADABLE))


# Checks and questions.


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
"""Methods of the protocol: those of `EditorSession` that answer, and their options."""


class SpecServer(LanguageServer):
    """Has files checked that have changed, one at a time, and publishes what is found."""

    def __init__(self) -> None:
        super().__init__(
            "specc",
            __version__,
            text_document_sync_kind=lsp.TextDocumentSyncKind.Full,
            protocol_cls=SpecProtocol,
        )
        self.worker = Worker(EditorSession, (RenameError,))
        self._changed: dict[str, bool] = {}
        """URIs to check; whether systems that use them are looked for on the disk."""
        self._reported: set[str] = set()
        self._given_up: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None
        self._check: asyncio.Task[None] | None = None
        self._abandoned: asyncio.Task[None] | None = None
        self._took_s = 0.0
        self.was_shut_down = False
        self.left_without_shutdown = False

    def report_server_error(self, error: Exception, source: Any) -> None:
        """Tell the client about an error that no answer reports."""
        if isinstance(error, _UNREADABLE) and isinstance(self.protocol, SpecProtocol):
            self.protocol.refuse(JsonRpcParseError("the message is not JSON"))
        else:
            super().report_server_error(error, source)

    def _client_state(self) -> ClientState:
        """The texts and folders of the client; older ones have a single root instead."""
        space = self.workspace
        folders = [uris.to_fs_path(uri) for uri in space.folders] or [space.root_path]
        texts = {document.uri: document.source for document in space.text_documents.values()}
        return ClientState(str(space.position_encoding), tuple(filter(None, folders)), texts)

    async def answer(self, feature: str, params: Any) -> Any:
        """The answer to a question; one that the client cancels does not end the process."""
        call = self.worker.call("answer", self._client_state(), feature, params)
        try:
            return await asyncio.shield(asyncio.ensure_future(call))
        except RenameError as error:
            raise JsonRpcInvalidRequest(str(error)) from None
        except ProcessEndedError as why:
            self._check_all()
            raise JsonRpcContentModified(f"given up, since it {why}") from None
        except CallFailedError as error:
            raise JsonRpcInternalError(str(error)) from None

    def start_worker(self) -> None:
        """Start the process before the first text comes: it takes its time to begin."""
        self._starting = asyncio.ensure_future(self.worker.call(""))

    def schedule_check(self, uri: str, *, search: bool = False) -> None:
        """Check a file after a pause; a change in the pause begins it anew."""
        self._given_up.discard(uri)
        self._changed[uri] = search or self._changed.get(uri, False)
        if self._timer is not None:
            self._timer.cancel()
        loop = asyncio.get_running_loop()
        pause = PAUSE_S if self._took_s < QUICK_S else min(self._took_s, LONGEST_PAUSE_S)
        self._timer = loop.call_later(pause, self._next_check)
        if self._check is not None:
            started_s = self.worker.started_s or time.monotonic()
            rest_s = started_s + PATIENCE_S - time.monotonic()
            loop.call_later(max(rest_s, 0.0), self._abandon, self._check)

    def _abandon(self, check: asyncio.Task[None]) -> None:
        """End a check of a text that has changed."""
        self._abandoned = check
        check.cancel()

    def _next_check(self) -> None:
        """Check a file that has changed; while a check runs the others wait."""
        if self._check is None and self._changed and not self.was_shut_down:
            uri = next(iter(self._changed))
            self._check = asyncio.ensure_future(self._run_check(uri, self._changed.pop(uri)))

    async def _run_check(self, uri: str, search: bool) -> None:
        """Publish what a check finds; a fault of ours must not end the server."""
        versions = {uri: d.version for uri, d in self.workspace.text_documents.items()}
        arguments = self._client_state(), uri, search, set(self._reported)
        try:
            self._publish(await self.worker.call("analyse", *arguments), versions)
        except ProcessEndedError as why:
            self._given_up.add(uri)
            self._publish({uri: [_given_up(why)]}, versions)
            self._check_all()
        except asyncio.CancelledError:
            if self._abandoned is not self._check:
                raise  # the server ends
            self._changed.setdefault(uri, search)
            self._check_all()
        except Exception as error:  # noqa: BLE001  # a fault of ours: the next change is checked
            _LOG.error("a fault of specc itself, not of your files: %s", error)
        self._took_s = self.worker.took_s
        self._check = None
        self._next_check()

    def _check_all(self) -> None:
        """Check all open texts anew: a new process knows nothing of them."""
        for uri in self._client_state().texts.keys() - self._given_up:
            self._changed.setdefault(uri, True)
        self._next_check()

    def _publish(
        self, found: dict[str, list[lsp.Diagnostic]], versions: dict[str, int | None]
    ) -> None:
        for uri, diagnostics in found.items():
            self.text_document_publish_diagnostics(
                lsp.PublishDiagnosticsParams(uri, diagnostics, versions.get(uri))
            )
            (self._reported.add if diagnostics else self._reported.discard)(uri)


def _given_up(why: ProcessEndedError) -> lsp.Diagnostic:
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
        _register_request(server, method, name, options)
    return server


def _register_request(server: SpecServer, method: str, name: str, options: Any) -> None:
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
        server.start_worker()

    @server.feature(lsp.SHUTDOWN)
    def shutdown(params: None) -> None:
        server.was_shut_down = True
        server.worker.close()

    @server.feature(lsp.EXIT)
    def leave(params: None) -> None:
        server.left_without_shutdown = not server.was_shut_down


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
        server.schedule_check(params.text_document.uri, search=True)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def changed(params: lsp.DidChangeTextDocumentParams) -> None:
        server.schedule_check(params.text_document.uri)

    @server.feature(lsp.TEXT_DOCUMENT_DID_SAVE)
    def saved(params: lsp.DidSaveTextDocumentParams) -> None:
        server.schedule_check(params.text_document.uri, search=True)

    @server.feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def closed(params: lsp.DidCloseTextDocumentParams) -> None:
        server.schedule_check(params.text_document.uri)

    @server.feature(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def watched(params: lsp.DidChangeWatchedFilesParams) -> None:
        for event in params.changes:
            server.schedule_check(event.uri)


def serve() -> int:
    """Speak with a client over standard input and output until it ends; the code to exit with."""
    # The protocol owns standard output: what anything else prints goes to standard error.
    output = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    logging.basicConfig(level=logging.WARNING)
    for name in ("pygls.protocol.json_rpc", "pygls.server"):
        logging.getLogger(name).addFilter(_is_fault)
    server = create_server()
    try:
        server.start_io(cast(BinaryIO, Incoming(sys.stdin.buffer)), output)
    finally:
        server.worker.close()
    return 1 if server.left_without_shutdown else 0
