"""The command `python -m specc_runtime`, before anything heavy is imported."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from specc_runtime.extras import remedy
from specc_runtime.leftovers import Leftovers, leave
from specc_runtime.options import Options, parse, parse_program
from specc_runtime.printing import abandon, say

if TYPE_CHECKING:
    from specc_runtime.page.page import Page

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


BROKEN_PIPE = 141
has_threads = False
"""Whether the run has left threads behind for which Python would wait at its end."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a generated system; see `--help` and `run`."""
    try:
        options = parse(arguments)
    except SystemExit as done:
        return int(done.code or 0)
    return run(options)


def program(name: str, directory: Path, base: Path, arguments: Sequence[str] | None = None) -> int:
    """Run the generated system in `directory` as a program of that name; see `--help` and `run`.

    It goes on until it is stopped, unless the arguments (those of the process by default) say how
    long; 0 is the exit code then, too. `base` is the folder of the files that the specification
    names. The process ends at once if the run has left threads behind.
    """
    try:
        options = parse_program(name, arguments, directory=directory, base=base)
    except SystemExit as done:
        return int(done.code or 0)
    code = run(options)
    if has_threads:
        leave(code)
    return code


def run(options: Options, page: Page | None = None) -> int:
    """Run a generated system as asked, in this process; a `page` shows it.

    Exit code 0: done, all cycles fulfilled; 1: not fulfilled, or a fault; 2: wrong usage, or a file
    that cannot be read or written, the film and standard output among them; 130: interrupted, 143:
    by SIGTERM; 141: nobody reads the output any more.
    """
    # Threads in BLAS cost more than they bring for small arrays, and it reads this when loaded.
    for variable in THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")
    leftovers = Leftovers()
    try:
        from specc_runtime.application import execute

        return execute(options, page)
    except ModuleNotFoundError as error:
        say(f"error: {remedy(error)}")
        return 2
    except OSError as error:
        # Standard output is closed, full or not read; the report has been written.
        abandon(sys.stdout)
        if isinstance(error, BrokenPipeError):
            return BROKEN_PIPE
        with contextlib.suppress(OSError):
            say(f"error: the output cannot be written: {error.strerror}")
        return 2
    except SystemExit as left:
        say(f"error: a module of the specification called exit({left.code})")
        return 1
    except KeyboardInterrupt:
        say("interrupted")
        return 130
    finally:
        global has_threads
        has_threads = leftovers.end()
