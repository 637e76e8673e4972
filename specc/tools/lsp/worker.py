"""A process that does jobs one after the other and can be ended at any time.

Whatever happens to a job, the process that asked for it goes on: a job that is no longer wanted, or
takes too long, is ended with its process, and another process takes its place.
"""

from __future__ import annotations

import asyncio
import gc
import multiprocessing
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from specc.processes import end_with_parent

LIMIT_S = 10.0
"""A job that takes longer is given up."""
LIMIT_GB = 2
"""Address space of the process; a job that needs more is given up."""
_NEW_OBJECTS = 10_000
"""Between two collections of garbage: a job makes many objects, and most of them stay."""

MethodCall = tuple[str, tuple[Any, ...]]
"""Name of a method and its arguments."""


class JobAbandonedError(Exception):
    """The process of a job was ended, since nobody wants the result any more."""


class JobGivenUpError(JobAbandonedError):
    """The process of a job has ended: the job took too long or too much; the message says which."""


class JobFailedError(Exception):
    """A job raised what it should not have; the message is the traceback."""


@dataclass(eq=False, slots=True)
class Job:
    """A call, and who waits for its result."""

    call: MethodCall
    result: asyncio.Future[Any]
    started_s: float | None = None


class Worker:
    """Calls methods of what `make` makes, in another process.

    `begin` gives the calls that a new process starts with: what its predecessor knew.
    """

    def __init__(
        self,
        make: Callable[[], object],
        begin: Callable[[], Iterable[MethodCall]],
        answers: tuple[type[Exception], ...] = (),
    ) -> None:
        """`answers` are what jobs may raise; anything else is a fault."""
        self._make, self._begin, self._answers = make, begin, answers
        self._jobs: deque[Job] = deque()
        self._running: Job | None = None
        self._process: Any = None
        self._pipe: Any = None
        self._overdue: asyncio.TimerHandle | None = None

    def ask(self, name: str, *arguments: Any) -> Job:
        """Put a call behind those that wait."""
        job = Job((name, arguments), asyncio.get_running_loop().create_future())
        self._jobs.append(job)
        if self._process is None:
            self._start()
        self._next()
        return job

    def abandon(self, job: Job) -> None:
        """End a job that runs, or forget one that waits."""
        if job in self._jobs:
            self._jobs.remove(job)
            self._fail(job, JobAbandonedError())
        elif job is self._running:
            self.close()
            self._fail(job, JobAbandonedError())
            self._next()

    def _give_up(self, why: str) -> None:
        """End the job that runs with its process."""
        job = self._running
        self.close()
        if job is not None:
            self._fail(job, JobGivenUpError(why))
        self._next()

    def close(self) -> None:
        """End the process; with the next job another one begins."""
        if self._overdue is not None:
            self._overdue.cancel()
        if self._process is not None:
            self._process.kill()
            self._pipe.close()
        self._process = self._pipe = self._running = None

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        arguments = (theirs, self._make, self._answers)
        self._process = context.Process(target=_work, args=arguments, daemon=True)
        self._process.start()
        theirs.close()
        loop = asyncio.get_running_loop()
        listen = threading.Thread(target=self._listen, args=(self._pipe, loop), daemon=True)
        self._jobs.extendleft(
            Job(call, loop.create_future()) for call in reversed([("", ()), *self._begin()])
        )
        listen.start()

    def _next(self) -> None:
        """Send the next job, if none runs; the process waits for it, so sending takes no time."""
        if self._running is not None or not self._jobs:
            return
        if self._process is None:
            self._start()
        job = self._running = self._jobs.popleft()
        job.started_s = time.monotonic()
        loop = asyncio.get_running_loop()
        self._overdue = loop.call_later(LIMIT_S, self._give_up, f"took more than {LIMIT_S:.0f} s")
        with suppress(OSError):  # the process is gone, which who listens to it will say
            self._pipe.send(job.call)

    def _listen(self, pipe: Connection, loop: asyncio.AbstractEventLoop) -> None:
        while True:
            try:
                answer = pipe.recv()
            except (EOFError, OSError):
                answer = None
            try:
                loop.call_soon_threadsafe(self._arrived, pipe, answer)
            except RuntimeError:
                return  # the loop has ended
            if answer is None:
                return

    def _arrived(self, pipe: Connection, answer: tuple[Any, Exception | None] | None) -> None:
        job = self._running
        if pipe is not self._pipe or job is None:
            return  # of a process that was ended
        if answer is None:
            self._give_up("ended its process")
            return
        value, error = answer
        if isinstance(error, JobGivenUpError):
            self._give_up(str(error))  # what the process has left is not enough for another job
            return
        if self._overdue is not None:
            self._overdue.cancel()
        self._running = None
        if error is not None:
            self._fail(job, error)
        elif not job.result.done():
            job.result.set_result(value)
        self._next()

    @staticmethod
    def _fail(job: Job, error: Exception) -> None:
        if not job.result.done():
            job.result.set_exception(error)
            job.result.exception()  # nobody waits for some results


def _work(
    pipe: Connection, make: Callable[[], object], answers: tuple[type[Exception], ...]
) -> None:
    """Do what comes through the pipe until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _limit_memory()
    gc.set_threshold(_NEW_OBJECTS)
    end_with_parent()
    desk = make()
    while True:
        try:
            name, arguments = pipe.recv()
        except (EOFError, OSError):
            return
        value: Any = None
        error: Exception | None = None
        try:
            value = getattr(desk, name)(*arguments) if name else None
        except answers as raised:
            error = raised
        except MemoryError:
            error = JobGivenUpError(f"took more than {LIMIT_GB} GB of memory")
        except Exception:  # noqa: BLE001 - it is for the other side to tell
            error = JobFailedError(traceback.format_exc())
        try:
            pipe.send((value, error))
        except OSError:
            return


def _limit_memory() -> None:
    if sys.platform != "win32":
        import resource

        _, most = resource.getrlimit(resource.RLIMIT_AS)
        wanted = LIMIT_GB * 10**9
        with suppress(ValueError, OSError):  # some systems have no such limit
            least = wanted if most == resource.RLIM_INFINITY else min(wanted, most)
            resource.setrlimit(resource.RLIMIT_AS, (least, most))
