"""The protocol of the server: whatever a message is, it is answered as JSON-RPC says."""

from __future__ import annotations

import logging
import re
from typing import Any, BinaryIO
from urllib.parse import unquote

from lsprotocol import types as lsp
from pygls.exceptions import (
    JsonRpcContentModified,
    JsonRpcException,
    JsonRpcInvalidParams,
    JsonRpcInvalidRequest,
    JsonRpcParseError,
    JsonRpcServerNotInitialized,
)
from pygls.protocol import LanguageServerProtocol

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
_TOLD = JsonRpcInvalidRequest, JsonRpcInvalidParams, JsonRpcContentModified
_UNREADABLE = ValueError, RecursionError


class SpecProtocol(LanguageServerProtocol):
    """Looks at a message as a whole before it is taken apart."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        """The data itself: it is asked for every object inside of a message."""
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


def unreadable(error: Exception) -> JsonRpcException | None:
    """The refusal of a message that is no JSON; None for any other error."""
    known = isinstance(error, _UNREADABLE)
    return JsonRpcParseError("the message is not JSON") if known else None


def is_fault(record: logging.LogRecord) -> bool:
    """Whether what pygls logs is a fault of the server, not of its client."""
    error = record.exc_info[1] if record.exc_info else None
    if error is None:
        return record.levelno >= logging.ERROR and not record.getMessage().startswith("Unable to")
    return not isinstance(error, (*_TOLD, *_UNREADABLE))
