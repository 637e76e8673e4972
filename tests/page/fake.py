"""A run as the page knows it: what it sends through its socket, and what it is told."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from http.client import HTTPConnection, HTTPResponse
from typing import Any
from urllib.parse import urlsplit

from websockets.sync.client import ClientConnection, connect

from tests.house.tree import ROOT

BEGIN = {
    "kind": "begin", "tick_s": 0.01, "seed": 1, "real_time": False, "begin_s": 0.0,
    "duration_s": 60.0, "cycles": None, "set": {}, "exact": False, "subsystems": [], "bodies": [],
    "scene": None, "cameras": [], "live": [], "panel": [], "can": {"pause": True, "restart": True},
}  # fmt: skip


@dataclass
class FakeRun:
    """The end of the run, and the process of the server."""

    end: socket.socket
    process: subprocess.Popen[str]
    url: str

    def __post_init__(self) -> None:
        self.lines = self.end.makefile("rb")
        parts = urlsplit(self.url)
        self.port = parts.port or 0
        self.token = parts.query.removeprefix("token=")
        self.cookie = f"specc-{self.port}={self.token}"

    def send(self, kind: str, **content: Any) -> None:
        self.send_bytes(json.dumps({"kind": kind, **content}).encode() + b"\n")

    def send_bytes(self, line: bytes) -> None:
        self.end.sendall(line)

    def begin(self, **content: Any) -> None:
        self.send(**{**BEGIN, **content})

    def state(self, time_s: float, steps: Any = None, **content: Any) -> None:
        found = {"status": "running", "speed": 1.0, "factor": 1.0, "plant": {}, "poses": None}
        found |= {"requirements": [], "live": {}, "panel": {}}
        self.send("state", time_s=time_s, steps=steps or {}, **(found | content))

    def command(self, *wanted: str) -> dict[str, Any]:
        """The next command of these kinds."""
        while True:
            found: dict[str, Any] = json.loads(self.lines.readline())
            if found["do"] in wanted:
                return found

    def get(self, path: str, **headers: str) -> HTTPResponse:
        """The answer to a request; a header with "" is left out, `Cookie` and `Host` as well."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=20)
        own = {"Host": f"127.0.0.1:{self.port}", "Cookie": self.cookie} | headers
        connection.putrequest("GET", path, skip_host=True, skip_accept_encoding=True)
        for name, value in own.items():
            if value:
                connection.putheader(name, value)
        connection.endheaders()
        return connection.getresponse()

    @contextmanager
    def visit(self, origin: str | None = "", cookie: str | None = None) -> Iterator[Visitor]:
        """A WebSocket of a page."""
        url = f"ws://127.0.0.1:{self.port}/ws"
        origin = f"http://127.0.0.1:{self.port}" if origin == "" else origin
        headers = {"Cookie": self.cookie if cookie is None else cookie}
        with connect(
            url, origin=origin, additional_headers=headers, max_size=None, compression=None
        ) as own:
            yield Visitor(own)


@dataclass
class Visitor:
    """A page that is connected."""

    connection: ClientConnection

    def send(self, type: str, **content: Any) -> None:
        self.connection.send(json.dumps({"type": type, **content}))

    def next(self, *kinds: str, timeout_s: float = 20.0) -> dict[str, Any]:
        """The next message of these types."""
        while True:
            text = self.connection.recv(timeout=timeout_s)
            if isinstance(text, str):
                found: dict[str, Any] = json.loads(text, parse_constant=_no_json)
                if found["type"] in kinds:
                    return found

    def next_binary(self) -> bytes:
        while True:
            text = self.connection.recv(timeout=20)
            if isinstance(text, bytes):
                return text

    def ask(self, type: str, **content: Any) -> dict[str, Any]:
        """The answer to a question."""
        self.send(type, id=7, **{"time_s": None, **content})
        return self.next({"look": "moment"}.get(type, type))


def _no_json(name: str) -> Any:
    raise AssertionError(f"{name} is no JSON")


@contextmanager
def fake_run(spec: str, options: Sequence[str] = (), begins: bool = True) -> Iterator[FakeRun]:
    """A run of a specification whose page is served."""
    own, other = socket.socketpair()
    command = [sys.executable, "-m", "specc.tools.page.live", str(other.fileno()), spec, *options]
    path = os.pathsep.join(["runtime", os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen(
        command, cwd=ROOT, pass_fds=[other.fileno()], stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    other.close()
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        assert line.startswith("specc: http://127.0.0.1:"), line + process.stderr.read()
        run = FakeRun(own, process, line.removeprefix("specc: ").strip())
        if begins:
            run.begin()
        yield run
    finally:
        own.shutdown(socket.SHUT_RDWR)
        own.close()
        try:
            assert process.wait(20) == 0
        finally:
            process.kill()
            process.stderr.close()
