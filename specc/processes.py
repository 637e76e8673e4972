"""Processes that work side by side, and the signals that end them."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

ENDING = frozenset(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Ctrl-C, the request to end, and the loss of the terminal: a command treats them alike."""


@contextmanager
def defer_signals() -> Iterator[None]:
    """Make the signals wait, for this thread and for the threads and processes that it starts."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def cores() -> int:
    """How many cores this process may use; all that there are where that is not known."""
    known = getattr(os, "sched_getaffinity", None)  # not everywhere
    return len(known(0)) if known else os.cpu_count() or 1


@contextmanager
def processes(workers: int, method: str) -> Iterator[ProcessPoolExecutor]:
    """So many at most, started by a method of multiprocessing; ended at once after an exception.

    Work is submitted while signals are deferred, so that all processes are known when one comes.
    """
    import multiprocessing  # only here: most commands need one process
    from concurrent.futures import ProcessPoolExecutor

    context = multiprocessing.get_context(method)
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=end_with_parent)
    try:
        yield pool
    except BaseException:
        for process in multiprocessing.active_children():
            process.kill()  # deferred signals do not reach them
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def end_with_parent() -> None:
    """End this process when the one that started it ends, whatever it is doing."""
    import multiprocessing
    import threading

    def watch() -> None:
        try:
            if parent := multiprocessing.parent_process():
                parent.join()
            if sys.stderr is not None:
                sys.stderr.flush()
        finally:
            os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
