"""Ctrl-C ends the process with one line, while modules are loaded and after the work is done too.

It is imported before anything else of the command, so it imports little itself.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress

INTERRUPTED = 130
MESSAGE = "specc: interrupted"
_AGAIN_S = 0.001


@contextmanager
def loading() -> Iterator[None]:
    """Meanwhile Ctrl-C ends the process at once: nothing has been begun that could break."""
    own = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    # Only the main thread may set handlers; elsewhere signals are somebody else's.
    with suppress(ValueError):
        # Any other handler is that of a program which the command is a part of.
        if own:
            signal.signal(signal.SIGINT, _end)
    yield
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def terminable() -> Iterator[None]:
    """Meanwhile SIGTERM does what Ctrl-C does, so that what was done is kept and left in order."""
    before = signal.getsignal(signal.SIGTERM)
    with suppress(ValueError):
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        with suppress(ValueError):
            signal.signal(signal.SIGTERM, before or signal.SIG_DFL)


@contextmanager
def held() -> Iterator[None]:
    """Meanwhile this thread, and the processes and threads that it starts, get no Ctrl-C."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def raise_again() -> None:
    """Handle Ctrl-C where Python would print and forget it: in callbacks, e.g. of imports."""
    sys.unraisablehook = _unraisable


def is_behind(error: BaseException) -> bool:
    """Whether Ctrl-C is what an error comes from: Python wraps what is raised in `__set_name__`."""
    cause = error.__cause__
    return isinstance(cause, KeyboardInterrupt) or (cause is not None and is_behind(cause))


def no_more() -> None:
    """Ignore Ctrl-C from now on: the process is about to end with a code that is known."""
    with suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _end(number: int, frame: object) -> None:
    os.write(2, f"{MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


def _unraisable(fault: sys.UnraisableHookArgs) -> None:
    if not issubclass(fault.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(fault)
    elif hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, signal.default_int_handler)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
