"""The command `python -m specc_runtime`, before anything heavy is imported."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from specc_runtime.options import parse

THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a generated system; see `--help`.

    Exit code 0: done, all cycles fulfilled; 1: not fulfilled, or a fault; 2: wrong usage, or a file
    that cannot be read or written; 130: interrupted.
    """
    try:
        options = parse(arguments)
    except SystemExit as done:
        return int(done.code or 0)
    # Threads in BLAS cost more than they bring for small arrays, and it reads this when loaded.
    for variable in THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")
    from specc_runtime.application import execute

    try:
        return execute(options)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
