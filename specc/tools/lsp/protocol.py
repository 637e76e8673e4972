"""The protocol of the server: whatever a message is, it is answered as JSON-RPC says."""

from __future__ import annotations

import logging
from typing import Any
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
            if self._is_due(message):
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

    def _is_due(self, message: Any) -> bool:
        """Whether a message comes at its time; raises JsonRpcException for one that is none."""
        if not _is_message(message):
            raise JsonRpcInvalidRequest("not a message of JSON-RPC 2.0")
        method = message.get("method", lsp.EXIT)
        if self._workspace is None and method not in (lsp.INITIALIZE, lsp.EXIT):
            raise JsonRpcServerNotInitialized("the first request is `initialize`")
        if self._shutdown and method != lsp.EXIT:
            raise JsonRpcInvalidRequest("the server is shutting down")
        return True

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
