"""A language client that follows a script: JSON-RPC over the pipes of a real server process."""

from __future__ import annotations

import json
import queue
import subprocess
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

PATIENCE_S = 60.0
Message = dict[str, Any]


class ServerError(Exception):
    """The server answered a request with an error."""

    code = 0


class Client:
    """Starts a server, initialises it, and ends it on leaving the `with` block."""

    def __init__(
        self, command: Sequence[str], folder: Path, settings: dict[str, Any] | None = None
    ) -> None:
        self.folder = folder
        self._settings = settings or {}
        self._process = subprocess.Popen(
            list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=folder
        )
        self._arrived: queue.Queue[Message | None] = queue.Queue()
        self._waiting: list[Message] = []
        self._versions: dict[str, int] = {}
        self._number = 0
        threading.Thread(target=self._read, daemon=True).start()
        capabilities = {
            "textDocument": {
                "completion": {"completionItem": {"documentationFormat": ["markdown"]}},
                "publishDiagnostics": {"relatedInformation": True, "versionSupport": True},
                "rename": {"prepareSupport": True},
            },
            "workspace": {"configuration": True, "workspaceFolders": True},
        }
        self.capabilities = self.request(
            "initialize",
            {
                "processId": None,
                "rootUri": folder.as_uri(),
                "workspaceFolders": [{"uri": folder.as_uri(), "name": folder.name}],
                "capabilities": capabilities,
            },
        )["capabilities"]
        self.notify("initialized", {})

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.request("shutdown", None)
            self.notify("exit", None)
            self.exit_code = self._process.wait(PATIENCE_S)
        finally:
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe:
                    pipe.close()

    def request(self, method: str, params: Any) -> Any:
        """The result of a request; raises `ServerError`."""
        self._number += 1
        number = self._number
        self._send({"id": number, "method": method, "params": params})
        answer = self._next(lambda message: message.get("id") == number and "method" not in message)
        if "error" in answer:
            refused = ServerError(answer["error"]["message"])
            refused.code = answer["error"]["code"]
            raise refused
        return answer["result"]

    def notify(self, method: str, params: Any) -> None:
        """Send a notification."""
        self._send({"method": method, "params": params})

    def open(self, path: Path, text: str | None = None) -> str:
        """Open a file, or an unsaved text of that name; the URI."""
        return self.open_as(path.as_uri(), path.read_text() if text is None else text)

    def open_as(self, uri: str, text: str) -> str:
        """Open a text under a URI."""
        self._versions[uri] = 1
        item = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
        self.notify("textDocument/didOpen", {"textDocument": item})
        return uri

    def close(self, uri: str) -> None:
        """Close a file; what is said of it then is about the file on the disk."""
        del self._versions[uri]
        self.notify("textDocument/didClose", {"textDocument": {"uri": uri}})

    def close_all(self) -> None:
        """Close every file that is open."""
        for uri in list(self._versions):
            self.close(uri)

    def change(self, uri: str, text: str) -> None:
        """Replace the whole text of an open file."""
        self._versions[uri] += 1
        document = {"uri": uri, "version": self._versions[uri]}
        changes = [{"text": text}]
        params = {"textDocument": document, "contentChanges": changes}
        self.notify("textDocument/didChange", params)

    def ask(self, method: str, uri: str, line: int, character: int, **more: Any) -> Any:
        """The result of a request about a position."""
        position = {"line": line, "character": character}
        params = {"textDocument": {"uri": uri}, "position": position, **more}
        return self.request(f"textDocument/{method}", params)

    def diagnostics(self, uri: str) -> list[Message]:
        """The next diagnostics that are published for the present version of a file."""

        def fits(message: Message) -> bool:
            params = message.get("params") or {}
            return (
                message.get("method") == "textDocument/publishDiagnostics"
                and params["uri"] == uri
                and params.get("version") in (None, self._versions.get(uri))
            )

        found: list[Message] = self._next(fits)["params"]["diagnostics"]
        return found

    def _next(self, fits: Callable[[Message], bool]) -> Message:
        """The first message that fits; others wait for their turn."""
        for message in self._waiting:
            if fits(message):
                self._waiting.remove(message)
                return message
        while True:
            arrived = self._arrived.get(timeout=PATIENCE_S)
            if arrived is None:
                raise ServerError(f"the server ended with {self._process.wait()}")
            if fits(arrived):
                return arrived
            self._waiting.append(arrived)

    def _send(self, message: Message) -> None:
        body = json.dumps({"jsonrpc": "2.0", **message}).encode()
        pipe = self._process.stdin
        assert pipe is not None
        pipe.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
        pipe.flush()

    def _read(self) -> None:
        pipe = self._process.stdout
        assert pipe is not None
        while (line := pipe.readline()).strip():
            length = int(line.split(b":")[1]) if line.lower().startswith(b"content-length") else 0
            while pipe.readline().strip():
                pass
            message = json.loads(pipe.read(length))
            if "id" in message and "method" in message:
                self._answer(message)
            else:
                self._arrived.put(message)
        self._arrived.put(None)

    def _answer(self, message: Message) -> None:
        result: Any = None
        if message["method"] == "workspace/configuration":
            result = [
                self._settings.get(item.get("section")) for item in message["params"]["items"]
            ]
        self._send({"id": message["id"], "result": result})
