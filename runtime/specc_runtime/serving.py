"""Runs one after another, each in a copy of this process, which has loaded what all of them need.

`python -m specc_runtime.serving` reads jobs from standard input, each a line of JSON with options
of a run, and answers each with a line: exit code and report, or the code with which its process
died. No run leaves anything to the next one, in memory, in modules of operators, or in processes
that these have started. What runs print goes to standard error, which the caller should send to a
file. The process ends at once when its input does, with the run that is under way, and so never
outlives whoever started it. If it is killed itself, a guard beside it ends the run.
"""

from __future__ import annotations

import contextlib
import gc
import json
import os
import select
import signal
import sys
import traceback
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from specc_runtime.atomic_files import replacing
from specc_runtime.main import run
from specc_runtime.options import Options

_SHARED = ("application", "builtins", "values", "plants.mujoco")
"""Modules of the runtime that most runs need, with numpy and MuJoCo."""
_NOBODY = bytes(4)
"""What the guard is told when a run is over; when one begins it is the number of its process."""


def serve(scratch: Path) -> None:
    """Answer the jobs of standard input; `scratch` is a folder of this process alone."""
    guard = _guard()
    jobs = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    for name in _SHARED:
        with contextlib.suppress(ImportError):  # the run that needs it tells
            import_module(f"specc_runtime.{name}")
    gc.freeze()
    for line in jobs:
        answers.write(_answer(line, (jobs.fileno(), answers.fileno()), guard, scratch) + "\n")
        answers.flush()


def _guard() -> int:
    """Start a process that ends the run under way when this one is gone; returns where it listens.

    Until then it keeps standard output open: whoever reads that to its end waits for it.
    """
    reader, tell = os.pipe()
    if os.fork():
        os.close(reader)
        return tell
    os.setpgid(0, 0)
    os.close(tell)
    os.close(0)
    leader = last_leader = _NOBODY
    while last_leader:
        leader, last_leader = last_leader, os.read(reader, len(_NOBODY))
    if leader != _NOBODY:
        _kill_group(int.from_bytes(leader, "big"))
    os._exit(0)


def _answer(line: str, own: tuple[int, int], guard: int, scratch: Path) -> str:
    """What came of a job; `own` are the files by which jobs come and answers go."""
    answer = scratch / "answer.json"
    answer.unlink(missing_ok=True)
    ended, writer = os.pipe()  # until the child ends
    child = os.fork()
    if not child:
        for mine in own:  # what the run starts may outlive this process, and hold them
            os.dup2(0, mine)
        _let_go_in_forks(writer)
        os.setpgid(0, 0)
        _tell(guard, os.getpid().to_bytes(len(_NOBODY), "big"))
        os.close(guard)
        _perform(json.loads(line), scratch / "report.json", answer)
    os.close(writer)
    # The next job comes after this answer, so nothing is to be heard but the end of the input.
    waiting = select.poll()
    waiting.register(ended, 0)
    waiting.register(own[0], 0)
    if ended not in dict(waiting.poll()):
        os._exit(0)  # the guard sees to the run
    os.close(ended)
    _, status = os.waitpid(child, 0)
    _kill_group(child)
    _tell(guard, _NOBODY)
    if answer.exists():
        return answer.read_text(encoding="utf-8")
    return json.dumps({"died": os.waitstatus_to_exitcode(status)})


def _let_go_in_forks(descriptor: int) -> None:
    """Let only this process, and none that operators fork, say by this pipe that it is there."""
    left = [descriptor]

    def let_go() -> None:
        while left:  # forks of forks have other files by that number
            os.close(left.pop())

    os.register_at_fork(after_in_child=let_go)


def _tell(guard: int, what: bytes) -> None:
    with contextlib.suppress(BrokenPipeError):  # somebody has killed it
        os.write(guard, what)


def _kill_group(leader: int) -> None:
    """End a run, if it is there, and what it has started."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)


def _perform(job: Mapping[str, Any], report: Path, answer: Path) -> NoReturn:
    """Make a run, in the process that is for it alone."""
    try:
        if numbers := sys.modules.get("numpy.random"):
            numbers.seed()  # else the operators of all runs would draw the same without a seed
        report.unlink(missing_ok=True)
        named = ("directory", "base", "record")
        paths = {name: Path(job[name]) for name in named if name in job}
        code = run(Options(**{**job, **paths}, report=report, inline=True, quiet=True))
        found = json.loads(report.read_text(encoding="utf-8")) if report.exists() else None
        with replacing(answer) as aside:
            aside.write_text(json.dumps({"code": code, "report": found}), encoding="utf-8")
    except BaseException:  # noqa: BLE001  # whatever it is, this process has nothing else to do
        traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(1)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
