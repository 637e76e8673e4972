"""`specc run --ui`: the process that serves the page, and the runs that the page starts again."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any

from specc.cli import interruption
from specc.diagnostics.report import Finding, brief
from specc.refusal import Refused, reason_of

_PATIENCE_S = 2.0
"""Wall time that the server has to end by itself."""
_MOST_NAMED = 3


class PageRuns:
    """The runs that one page shows, one after the other; while entered, its server may run."""

    def __init__(self, options: Namespace, folder: Path) -> None:
        """`folder` is for what the next run goes on from. Raises Refused."""
        if find_spec("websockets") is None:
            raise Refused(import_module("specc_runtime.extras").lacking("websockets"))
        check_free(options.ui)
        self._first = self._options = options
        self._folder = folder
        self._past: list[tuple[float, Path]] = []
        """Simulated times from which on files know how a run was."""
        self._page: Any = None
        self._server: subprocess.Popen[bytes] | None = None
        self._count = 0

    def __enter__(self) -> PageRuns:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._page is not None:
            self._page.close()
        if self._server is not None:
            try:
                self._server.wait(_PATIENCE_S)
            except subprocess.TimeoutExpired:
                self._server.kill()
                self._server.wait()

    def all(self, run: Callable[[Namespace], int]) -> int:
        """Run, and again as often as the page asks; the exit code of the last run."""
        options, begun = self._options, 0
        while True:
            before = self._options, list(self._past)
            code = run(options)
            page = self._page
            if page is None or not page.begun:
                return code
            if page.begun == begun:  # it could not be run: what is shown is still the last one
                self._options, self._past = before
            begun = page.begun
            is_interrupted = page.is_interrupted or (code > 128 and page.restart is None)
            try:
                wanted = None if is_interrupted else page.wait()
            except interruption.Terminated:
                raise
            except KeyboardInterrupt:  # Ctrl-C closes the page of a run that is over
                return code
            if wanted is None:
                return code
            options = self._again(wanted)

    def launch(self, options: Namespace) -> Any:
        """The page of a run that is about to begin; its server is started with the first one."""
        self._options = options
        if self._page is None:
            self._serve()
        begin_s = options.resume[1] if options.resume else 0.0
        self._count += 1
        options.snapshots = None
        if options.record is None and not options.real_time:
            options.snapshots = self._folder / f"{self._count}.mcap"
        if file := options.record or options.snapshots:
            self._past.append((begin_s, Path(file).absolute()))
        self._page.objection = self._objection
        return self._page

    def refuse(self, findings: Sequence[Finding]) -> None:
        """Say in the page why a specification cannot be run as it asks."""
        if self._page is not None:
            words = "; ".join(map(brief, findings[:_MOST_NAMED]))
            self._page.refuse(f"The run cannot be started again: {words}")

    def _serve(self) -> None:
        options = self._options
        ours, theirs = socket.socketpair()
        words = ["-m", "specc.tools.page.live", str(theirs.fileno()), options.spec]
        words += ["--port", str(options.ui)]
        words += [f"--set={name}={text}" for name, text in options.set.items()]
        words += [] if options.scenario is None else [f"--scenario={options.scenario}"]
        path = os.pathsep.join(filter(None, sys.path))
        with theirs:
            self._server = subprocess.Popen(
                [sys.executable, "-P", *words],
                stdin=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                env={**os.environ, "PYTHONPATH": path},
                # Ctrl-C is for the run, which closes the page itself.
                process_group=0,
            )
        page = import_module("specc_runtime.page.page").Page
        self._page = page(ours.detach(), 1.0 if options.speed is None else options.speed)

    def _past_until(self, from_s: float) -> list[tuple[float, Path]]:
        """What is known of the runs from which one at that moment follows."""
        later = [each for each in self._past[1:] if each[0] < from_s]
        return [*self._past[:1], *later]

    def _objection(self, wanted: Any) -> str:
        """Why no run can go on from the moment that is asked for; "" if one can."""
        if not wanted.from_s:
            return ""
        begin_s, file = self._past_until(wanted.from_s)[-1]
        reach = self._page.reaches.get(file)
        if reach is None or not (lack := reach.lacks(wanted.from_s)):
            return ""
        other = f"before {begin_s:g} s it ran with other constants or another specification"
        way = "start from the beginning"
        return f"the run cannot go on from {wanted.from_s:g} s: {lack}, and {other}; {way}"

    def _again(self, wanted: Any) -> Namespace:
        """The options of the run that the page asks for."""
        first, last = self._first, self._options
        again = Namespace(**vars(first))
        again.set, again.resume = last.set | wanted.set, first.resume
        if wanted.from_s:
            self._past = self._past_until(wanted.from_s)
            again.resume = self._past[-1][1], wanted.from_s
        for name in ("record", "video"):  # what earlier runs have written stays
            if file := getattr(first, name):
                numbered = (file.with_stem(f"{file.stem}-{n}") for n in count(self._count + 1))
                setattr(again, name, next(each for each in numbered if not each.exists()))
        return again


def check_free(port: int) -> None:
    """Raises Refused for a port at which there can be no page."""
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind(("127.0.0.1", port))
        except OSError as error:
            raise Refused(f"no page at port {port}: {reason_of(error)}") from error
