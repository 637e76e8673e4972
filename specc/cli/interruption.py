"""Ctrl-C ends the process with one line, while modules are loaded and after the work is done too.

It is imported before anything else of the command, so it imports little itself.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

INTERRUPTED, TERMINATED = 130, 143
MESSAGE = "specc: interrupted"
_AGAIN_S = 0.001

is_over = False
"""Whether the process is about to end with a code that is known; Ctrl-C then changes nothing."""
_has_come = False


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


class Terminated(KeyboardInterrupt):
    """Raised by SIGTERM where it does what Ctrl-C does."""


def code_of(interrupt: KeyboardInterrupt) -> int:
    """The exit code of a command that was interrupted, as shells have it."""
    return TERMINATED if isinstance(interrupt, Terminated) else INTERRUPTED


@contextmanager
def terminable() -> Iterator[None]:
    """Meanwhile SIGTERM does what Ctrl-C does, so that what was done is kept and left in order."""
    before = signal.getsignal(signal.SIGTERM)
    with suppress(ValueError):
        signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        with suppress(ValueError):
            signal.signal(signal.SIGTERM, before or signal.SIG_DFL)


@contextmanager
def held() -> Iterator[None]:
    """Meanwhile Ctrl-C and SIGTERM wait, for this thread and those, and processes, it starts."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def begin() -> None:
    """Raise KeyboardInterrupt until `is_over`, even where Python would print and forget it.

    That is in callbacks, e.g. of imports.
    """
    sys.unraisablehook = _unraisable
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _raise)


def is_behind(error: BaseException) -> bool:
    """Whether Ctrl-C is what an error comes from: Python wraps what is raised in `__set_name__`."""
    cause = error.__cause__
    return isinstance(cause, KeyboardInterrupt) or (cause is not None and is_behind(cause))


def no_more() -> None:
    """Ignore Ctrl-C also when Python handles no signals any more."""
    with suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _terminate(number: int, frame: FrameType | None) -> None:
    raise Terminated


def _end(number: int, frame: FrameType | None) -> None:
    os.write(2, f"{MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


def _raise(number: int, frame: FrameType | None) -> None:
    global _has_come
    if not is_over:
        _has_come = True
        signal.default_int_handler(number, frame)


def _unraisable(fault: sys.UnraisableHookArgs) -> None:
    # A signal that came before SIG_IGN and was not yet handled: Python tells so of nothing.
    if is_over and issubclass(fault.exc_type, OSError) and fault.object is None:
        return
    if not issubclass(fault.exc_type, KeyboardInterrupt):
        # What was half made when Ctrl-C came may fail when it is deleted: z3 has such objects.
        if not _has_come:
            sys.__unraisablehook__(fault)
    elif hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, _raise)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
