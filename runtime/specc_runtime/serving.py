"""Runs one after another, each in a copy of this process, which has loaded what all of them need.

`python -m specc_runtime.serving` reads jobs from standard input, each a line of JSON with options
of a run, and answers each with a line: exit code and report, or the code with which its process
died. No run leaves anything to the next one, in memory, in modules of operators, or in processes
that these have started. What runs print goes to standard error, which the caller should send to a
file. The process ends at once when its input does, with the run that is under way, and so never
outlives whoever started it.
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
from ctypes import CDLL
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from specc_runtime.main import run
from specc_runtime.options import Options

_SHARED = ("application", "builtins", "values", "plants.mujoco")
"""Modules of the runtime that most runs need, with numpy and MuJoCo."""
_PR_SET_PDEATHSIG = 1


def serve(scratch: Path) -> None:
    """Answer the jobs of standard input; `scratch` is a folder of this process alone."""
    jobs = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)
    for name in _SHARED:
        with contextlib.suppress(ImportError):  # the run that needs it tells
            import_module(f"specc_runtime.{name}")
    gc.freeze()
    for line in jobs:
        answers.write(_answer(line, jobs.fileno(), answers.fileno(), scratch) + "\n")
        answers.flush()


def _answer(line: str, jobs: int, answers: int, scratch: Path) -> str:
    answer = scratch / "answer.json"
    answer.unlink(missing_ok=True)
    ended, held = os.pipe()  # until the child ends
    child = os.fork()
    if not child:
        for mine in (jobs, answers):  # what the run starts may outlive this process, and hold them
            os.dup2(0, mine)
        _let_go_in_forks(held)
        os.setpgid(0, 0)
        _perform(json.loads(line), scratch / "report.json", answer)
    os.close(held)
    with contextlib.suppress(OSError):  # whichever of both is first
        os.setpgid(child, child)
    # The next job comes after this answer, so nothing is to be heard but the end of the input.
    waiting = select.poll()
    waiting.register(ended, 0)
    waiting.register(jobs, 0)
    if ended not in dict(waiting.poll()):
        _kill_group(child)
        os._exit(0)
    os.close(ended)
    _, status = os.waitpid(child, 0)
    _kill_group(child)
    if answer.exists():
        return answer.read_text(encoding="utf-8")
    return json.dumps({"died": os.waitstatus_to_exitcode(status)})


def _let_go_in_forks(held: int) -> None:
    """Let only this process, and none that operators fork, say by this pipe that it is there."""
    left = [held]

    def let_go() -> None:
        while left:  # forks of forks have other files by that number
            os.close(left.pop())

    os.register_at_fork(after_in_child=let_go)


def _kill_group(leader: int) -> None:
    """End a run, if it is there, and what it has started."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)


def _perform(job: Mapping[str, Any], report: Path, answer: Path) -> NoReturn:
    """Make a run, in the process that is for it alone."""
    if sys.platform == "linux":  # elsewhere a run outlives this process if that is killed
        CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    try:
        if numbers := sys.modules.get("numpy.random"):
            numbers.seed()  # else the operators of all runs would draw the same without a seed
        report.unlink(missing_ok=True)
        paths = {name: Path(job[name]) for name in ("directory", "base")}
        code = run(Options(**{**job, **paths}, report=report, inline=True, quiet=True))
        found = json.loads(report.read_text(encoding="utf-8")) if report.exists() else None
        aside = answer.with_suffix(".part")
        aside.write_text(json.dumps({"code": code, "report": found}), encoding="utf-8")
        aside.replace(answer)
    except BaseException:  # noqa: BLE001  # whatever it is, this process has nothing else to do
        traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(1)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
