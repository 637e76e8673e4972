"""Runs with a page, each in a process of its own, and what a page says of them."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from tests.house.tree import ROOT
from tests.page.browser import Page

URL = re.compile(r"http://127\.0\.0\.1:\d+/\?token=[\w-]+(?=\n)")
TIME = "parseFloat(document.getElementById('time').textContent)"
STATUS = "document.getElementById('status').textContent"
ENDED = "document.getElementById('status').classList.contains('is-ended')"
LIT = "[...document.querySelectorAll('#states .state.lit')].map(e => e.id.replace(/.*-s-/, ''))"
END_S = 60.0


@dataclass
class PageRun:
    """A command that serves a page; `path` is where it says what it prints."""

    process: subprocess.Popen[str]
    url: str
    output: Path

    @property
    def port(self) -> int:
        return urlsplit(self.url).port or 0

    @property
    def cookie(self) -> str:
        return f"specc-{self.port}={urlsplit(self.url).query.removeprefix('token=')}"

    def end(self) -> str:
        """Close the page with Ctrl-C; all that was printed."""
        self.process.send_signal(signal.SIGINT)
        self.process.wait(END_S)
        return self.output.read_text(encoding="utf-8")

    def deaf_client(self) -> socket.socket:
        """A client that asks for everything and never reads."""
        client = socket.create_connection(("127.0.0.1", self.port))
        lines = (
            "GET /ws HTTP/1.1", f"Host: 127.0.0.1:{self.port}", "Upgrade: websocket",
            "Connection: Upgrade", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
            "Sec-WebSocket-Version: 13", f"Origin: http://127.0.0.1:{self.port}",
            f"Cookie: {self.cookie}", "", "",
        )  # fmt: skip
        client.sendall("\r\n".join(lines).encode())
        return client


@contextmanager
def page_run(folder: Path, *words: object) -> Iterator[PageRun]:
    """`specc` with these words, once it has a page; it is ended at the end."""
    output = folder / "output.txt"
    command = [sys.executable, "-m", "specc", *map(str, words)]
    path = os.pathsep.join(filter(None, ("runtime", os.environ.get("PYTHONPATH"))))
    with output.open("w") as out:
        process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT,
            text=True, env={**os.environ, "PYTHONPATH": path},
        )  # fmt: skip
    try:
        end = time.monotonic() + END_S
        while not (found := URL.search(said := output.read_text(encoding="utf-8"))):
            assert process.poll() is None and time.monotonic() < end, said
            time.sleep(0.02)
        yield PageRun(process, found.group(), output)
    finally:
        process.kill()
        process.wait()


def wait_paused(page: Page, state: str) -> float:
    """The time shown, once the run is paused in a state of the chosen machine."""
    page.wait_for(f"{LIT} == '{state}' && {STATUS}.startsWith('paused')", END_S)
    time_s: float = page.evaluate(TIME)
    return time_s


def set_speed(page: Page, value: str) -> None:
    """Choose a speed in the page."""
    page.evaluate(
        f"""(() => {{
            const speed = document.getElementById("speed");
            speed.value = "{value}";
            speed.dispatchEvent(new Event("change"));
        }})()"""
    )
