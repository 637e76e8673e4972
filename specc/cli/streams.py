"""Standard streams: what is printed on them, and those that are closed, full or no longer read.

Files and specifications are strangers' texts, and nearly every output has parts of them. It goes
through `show` or `say`, which let no character through that steers a terminal and no line that a
runner of continuous integration takes for a command.
"""

import contextlib
import os
import sys
from typing import TextIO

from specc.diagnostics.render.visible import Form, harmless

_USUAL = 120


def prepare() -> None:
    """Make the standard streams take any character, and give those that are closed a stand-in.

    What is written to a closed standard output is an error when it is flushed, as it is with other
    commands; nobody would read a message about a closed standard error.
    """
    # In this order, so that each stand-in gets the number of the stream that it stands for.
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115 - stays open to the end
    if sys.stdout is None:
        descriptor = os.open(os.devnull, os.O_RDONLY)
        sys.stdout = open(descriptor, "w", encoding="utf-8")  # noqa: SIM115 - stays open
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - stays open
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def coloured(stream: TextIO) -> bool:
    """Whether a stream takes colours: a terminal, unless NO_COLOR says no (no-color.org)."""
    plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    return stream.isatty() and not plain


def columns(stream: TextIO) -> int:
    """Width of the terminal behind a stream; that of a usual one if it is none."""
    try:
        return os.get_terminal_size(stream.fileno()).columns or _USUAL
    except (OSError, ValueError):
        return _USUAL


def abandon(stream: TextIO) -> None:
    """Let a stream take whatever is left in it: Python flushes it once more at exit."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def show(text: str, form: Form = "text", *, to: TextIO | None = None) -> None:
    """Print to standard output, unless told where `to`."""
    (to or sys.stdout).write(harmless(text, form))


def say(message: str) -> None:
    """Print a message to standard error, if it takes one."""
    try:
        sys.stderr.write(harmless(f"{message}\n"))
        sys.stderr.flush()
    except OSError:
        abandon(sys.stderr)
