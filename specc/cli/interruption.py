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

from specc.processes import ENDING

INTERRUPTED = 130
MESSAGE = "specc: interrupted"
_AGAIN_S = 0.001

is_finished = False
"""Whether the process is about to end with a code that is known; signals then change nothing."""
_first_signal: signal.Signals | None = None
"""The first signal that has come."""


@contextmanager
def exiting_on_interrupt() -> Iterator[None]:
    """Meanwhile Ctrl-C ends the process at once: nothing has been begun that could break."""
    own = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    # Only the main thread may set handlers; elsewhere signals are somebody else's.
    with suppress(ValueError):
        # Any other handler is that of a program which the command is a part of.
        if own:
            signal.signal(signal.SIGINT, _exit_now)
    yield
    if signal.getsignal(signal.SIGINT) is _exit_now:
        signal.signal(signal.SIGINT, signal.default_int_handler)


class Terminated(KeyboardInterrupt):
    """Raised by SIGTERM and SIGHUP.

    After KeyboardInterrupt itself has passed `exec` Python ends its process by SIGINT.
    """


def is_interrupted() -> bool:
    """Whether a signal has interrupted the command."""
    return _first_signal is not None


def exit_code() -> int:
    """The exit code of a command that was interrupted, as shells have it."""
    return INTERRUPTED if _first_signal is None else 128 + _first_signal


def install_handlers() -> None:
    """Raise KeyboardInterrupt until `is_finished`, even where Python would print and forget it.

    That is in callbacks, e.g. of imports. A signal that is ignored, as by `nohup`, stays so.
    """
    sys.unraisablehook = _on_unraisable
    for number in ENDING:
        if signal.getsignal(number) in (signal.default_int_handler, signal.SIG_DFL):
            signal.signal(number, _interrupt)


def is_caused_by_interrupt(error: BaseException) -> bool:
    """Whether Ctrl-C is what an error comes from: Python wraps what is raised in `__set_name__`."""
    cause = error.__cause__
    return isinstance(cause, KeyboardInterrupt) or (
        cause is not None and is_caused_by_interrupt(cause)
    )


def ignore_signals() -> None:
    """Ignore the signals also when Python handles none any more."""
    with suppress(ValueError):
        for number in ENDING:
            signal.signal(number, signal.SIG_IGN)


def _exit_now(number: int, frame: FrameType | None) -> None:
    os.write(2, f"{MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


def _interrupt(number: int, frame: FrameType | None) -> None:
    global _first_signal
    # A terminal that closes sends several; only Ctrl-C is somebody who does not want to wait.
    is_new = _first_signal is None or number in (signal.SIGINT, signal.SIGALRM)
    if is_finished or not is_new:
        return
    if _first_signal is None:
        _first_signal = signal.Signals(number)
    raise KeyboardInterrupt if _first_signal == signal.SIGINT else Terminated


def _on_unraisable(fault: sys.UnraisableHookArgs) -> None:
    # A signal that came before SIG_IGN and was not yet handled: Python tells so of nothing.
    if is_finished and issubclass(fault.exc_type, OSError) and fault.object is None:
        return
    if not issubclass(fault.exc_type, KeyboardInterrupt):
        # What was half made when Ctrl-C came may fail when it is deleted: z3 has such objects.
        if _first_signal is None:
            sys.__unraisablehook__(fault)
    elif hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, _interrupt)
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
