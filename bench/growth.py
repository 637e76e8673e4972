"""How long `specc validate` takes as each list of a specification grows, in CPU time.

`tests/checks/test_growth.py` holds the calls to what is said here of the times.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from bench.harness.lists import GROWING, MAIN, put
from bench.harness.tables import table
from specc.cli.main import main as specc


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--sizes", type=int, nargs="*", default=[50, 100, 200, 400])
    parser.add_argument("--only", default="", help="lists with this in their name")
    options = parser.parse_args(arguments)
    rows = []
    for name in GROWING:
        if options.only in name:
            _cpu_s(name, 3)  # imports what it takes
            times = [_cpu_s(name, size) for size in options.sizes]
            rows.append((name, *(f"{1e3 * time:.0f}" for time in times)))
    title = "CPU time of `specc validate` without the start of its process, ms"
    print(table(title, ("list", *map(str, options.sizes)), rows))


def _cpu_s(name: str, size: int) -> float:
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        put(GROWING[name](size), Path(scratch))
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            begin = process_time()
            specc(["validate", str(Path(scratch, MAIN))])
            return process_time() - begin


if __name__ == "__main__":
    main()
