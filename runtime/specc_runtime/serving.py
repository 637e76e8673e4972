"""Runs one after another in one process, so that what they import is loaded once.

`python -m specc_runtime.serving` reads jobs from standard input, each a line of JSON with options
of a run, and answers each with a line: exit code and report. What runs print goes to standard
error, which the caller should send to a file. The process ends at once when its input does, even
during a run, and so never outlives whoever started it.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import sys
import threading
from collections.abc import Mapping
from ctypes import CDLL
from pathlib import Path
from queue import SimpleQueue
from typing import Any, TextIO

from specc_runtime.main import run
from specc_runtime.options import Options


def serve(scratch: Path) -> None:
    """Answer the jobs of standard input; `scratch` is a folder of this process alone."""
    jobs = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    waiting: SimpleQueue[str] = SimpleQueue()
    threading.Thread(target=_listen, args=(jobs, waiting), daemon=True).start()
    while True:
        answer = _answer(json.loads(waiting.get()), scratch / "report.json")
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
        _give_back()


def _listen(jobs: TextIO, waiting: SimpleQueue[str]) -> None:
    # A signal that this thread gets would not interrupt the run.
    signal.pthread_sigmask(signal.SIG_BLOCK, set(signal.Signals))
    for job in jobs:
        waiting.put(job)
    os._exit(0)


def _answer(job: Mapping[str, Any], report: Path) -> dict[str, Any]:
    report.unlink(missing_ok=True)
    paths = {name: Path(job[name]) for name in ("directory", "base")}
    given = {**job, **paths}
    limit_s = given.pop("limit_s")
    # Whoever waits for the answer ends a run that takes too long. Where nobody does any more and an
    # operator holds the interpreter, so that nothing above is heard, the system does it.
    signal.setitimer(signal.ITIMER_PROF, 2 * limit_s)
    code = run(Options(**given, report=report, inline=True, quiet=True))
    signal.setitimer(signal.ITIMER_PROF, 0)
    found = json.loads(report.read_text(encoding="utf-8")) if report.exists() else None
    return {"code": code, "report": found}


def _give_back() -> None:
    """Return the memory of a run to the system, before the next one takes as much again.

    What a run leaves is full of cycles, and glibc keeps freed pieces between others for itself.
    """
    gc.collect()
    if trim := getattr(CDLL(None), "malloc_trim", None):
        trim(0)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
