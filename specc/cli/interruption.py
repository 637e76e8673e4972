"""Ctrl-C, SIGTERM and SIGHUP end the process with one line, at any time of a command.

It is imported before anything else of the command, so it imports little itself.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from specc.signals import ENDING

INTERRUPTED = 130
MESSAGE = "specc: interrupted"
_AGAIN_S = 0.001

is_over = False
"""Whether the process is about to end with a code that is known; signals then change nothing."""
_came: signal.Signals | None = None
"""The first signal that has come."""


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
    """Raised by SIGTERM and SIGHUP.

    After KeyboardInterrupt itself has passed `exec` Python ends its process by SIGINT.
    """


def has_come() -> bool:
    """Whether a signal has interrupted the command."""
    return _came is not None


def exit_code() -> int:
    """The exit code of a command that was interrupted, as shells have it."""
    return INTERRUPTED if _came is None else 128 + _came


def begin() -> None:
    """Raise KeyboardInterrupt until `is_over`, even where Python would print and forget it.

    That is in callbacks, e.g. of imports. A signal that is ignored, as by `nohup`, stays so.
    """
    sys.unraisablehook = _unraisable
    for number in ENDING:
        if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):
            signal.signal(number, _raise)


def is_behind(error: BaseException) -> bool:
    """Whether Ctrl-C is what an error comes from: Python wraps what is raised in `__set_name__`."""
    cause = error.__cause__
    return isinstance(cause, KeyboardInterrupt) or (cause is not None and is_behind(cause))


def no_more() -> None:
    """Ignore the signals also when Python handles none any more."""
    with suppress(ValueError):
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)


def _end(number: int, frame: FrameType | None) -> None:
    os.write(2, f"{MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


def _raise(number: int, frame: FrameType | None) -> None:
    global _came
    # A terminal that closes sends several; only Ctrl-C is somebody who does not want to wait.
    is_new = _came is None or number in (signal.SIGINT, signal.SIGALRM)
    if is_over or not is_new:
        return
    if _came is None:
        _came = signal.Signals(number)
    raise KeyboardInterrupt if _came == signal.SIGINT else Terminated


def _unraisable(fault: sys.UnraisableHookArgs) -> None:
    # A signal that came before SIG_IGN and was not yet handled: Python tells so of nothing.
    if is_over and issubclass(fault.exc_type, OSError) and fault.object is None:
        return
    if not issubclass(fault.exc_type, KeyboardInterrupt):
        # What was half made when Ctrl-C came may fail when it is deleted: z3 has such objects.
        if _came is None:
            sys.__unraisablehook__(fault)
    elif hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, _raise)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
