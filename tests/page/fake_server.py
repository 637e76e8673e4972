"""A run with a page, whose server is the test: the other end of the socket pair."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Thread
from typing import Any, NamedTuple

from specc_runtime import main
from specc_runtime.options import Options
from specc_runtime.page.page import Page

from specc import output, pipeline
from specc.cli.recordings import recorded_texts
from tests.commands import ROOT

GATE = ROOT / "specs/conveyor_gate.yaml"
PATIENCE_S = 20.0
Message = dict[str, Any]


class Code(NamedTuple):
    """The code of a specification, and its texts."""

    spec: Path
    package: Path
    texts: Mapping[str, str]
    constants: Mapping[str, str]

    def options(self, **others: Any) -> Options:
        """The options of a run of it."""
        named: dict[str, Any] = {
            "directory": self.package,
            "base": self.spec.parent,
            "quiet": True,
            "texts": self.texts,
            "built_with": self.constants,
        }
        return Options(**named | others)


def written(spec: Path, folder: Path, *, real_time: bool = False, **constants: str) -> Code:
    """Write the code of a specification into a folder."""
    built = pipeline.build(str(spec), constants, is_read=False, tests_all_rows=real_time)
    package = folder / built.system
    assert list(output.write(package, built.files)) == []
    return Code(spec, package, recorded_texts(built.result.sources), constants)


class FakeServer:
    """Reads what runs send, in order, unless it is told to be deaf."""

    def __init__(self, end: socket.socket, *, is_deaf: bool = False) -> None:
        self.end = end
        self.messages: list[Message] = []
        self._thread = Thread(target=self._read, daemon=True)
        if not is_deaf:
            self._thread.start()

    def _read(self) -> None:
        with self.end.makefile("rb") as lines:
            for line in lines:
                self.messages.append(json.loads(line))

    def finish(self) -> None:
        """Read what has been sent, if anything is read."""
        if self._thread.is_alive():
            self._thread.join(10)

    def send(self, do: str, **command: Any) -> None:
        self.end.sendall(json.dumps({"do": do, **command}).encode() + b"\n")

    def await_obedience(self) -> None:
        """Wait until the commands so far are obeyed: one that is unknown is refused after them."""
        self.send("nothing")
        self.messages.remove(
            self.wait("refused", lambda told: told["text"] == "there is no command nothing")
        )

    def of(self, kind: str) -> list[Message]:
        return [message for message in self.messages if message["kind"] == kind]

    def whole(self) -> list[Message]:
        """The states that have all there is, and not only what moves."""
        return [state for state in self.of("state") if "steps" in state]

    def wait(
        self, kind: str, when: Callable[[Message], Any] = lambda message: True, after: int = 0
    ) -> Message:
        """The first message of a kind, after so many messages, for which that holds."""
        until_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < until_s:
            for message in self.messages[after:]:
                if message["kind"] == kind and when(message):
                    return message
            time.sleep(0.005)
        raise AssertionError(f"no {kind} came: {[m['kind'] for m in self.messages][-5:]}")

    def paused(self, after: int = 0) -> Message:
        return self.wait("state", lambda state: state["status"] == "paused", after)


class Shown:
    """A run in a thread, which a page shows."""

    def __init__(self, options: Options, *, speed: float | None = None, is_deaf: bool = False):
        ours, theirs = socket.socketpair()
        self.server = FakeServer(theirs, is_deaf=is_deaf)
        self.page = Page(ours.detach(), speed)
        self._options = options
        self.code = -1
        self.thread = Thread(target=self._run)

    def start(self) -> Shown:
        self.thread.start()
        return self

    def _run(self) -> None:
        self.code = main.run(self._options, self.page)

    def join(self) -> None:
        self.thread.join(60)
        assert not self.thread.is_alive()
        self.page.close()
        self.server.finish()

    @property
    def failure(self) -> str:
        return self.page._link.failure


@contextmanager
def shown(
    code: Code,
    *commands: Message,
    speed: float | None = None,
    is_deaf: bool = False,
    **options: Any,
) -> Iterator[Shown]:
    """A run with a page whose server gave these commands before the first tick."""
    run = Shown(code.options(**options), speed=speed, is_deaf=is_deaf)
    for command in ({"do": "watch", "clients": 1, "scene": True}, *commands):
        run.server.send(**command)
    if is_deaf:
        time.sleep(0.05)
    else:
        run.server.await_obedience()
    try:
        yield run.start()
    finally:
        if run.thread.is_alive():
            run.server.send("quit")
        run.join()
        assert run.failure == ""
