"""How long `specc run` takes until every subsystem of the flagship has made its first step.

Times count from the start of the process; a first one only warms the caches of files.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from statistics import median
from time import monotonic

from bench.harness.building import FLAGSHIP
from bench.harness.tables import table

PROBE = """
import json, os, sys
from time import monotonic, process_time

marks = {}

def mark(name):
    marks[name] = monotonic(), process_time()

def launch(*arguments):
    mark("generated")
    from specc_runtime.cycle import Executor
    first, wait = Executor.advance, Executor.wait

    def advance(executor):
        if not executor.tick:
            mark("loaded")
        return first(executor)

    def waited(executor):
        wait(executor)
        mark("first step")
        sys.stdout.write(json.dumps(marks))
        sys.stdout.flush()
        os._exit(0)

    Executor.advance, Executor.wait = advance, waited
    return launched(*arguments)

from specc.cli import main, run
launched, run.launch = run.launch, launch
main()
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--repeats", type=int, default=7)
    repeats = parser.parse_args(arguments).repeats
    runs = [_marks() for _ in range(repeats + 1)][1:]
    rows = [
        (name, *(f"{1e3 * median(run[name][clock] for run in runs):.0f}" for clock in (0, 1)))
        for name in runs[0]
    ]
    title = f"Start of a run, files read before, median of {repeats}"
    print(table(title, ("until", "wall, ms", "CPU, ms"), rows))


def _marks() -> dict[str, tuple[float, float]]:
    """Wall and CPU seconds until each mark of one process."""
    command = (sys.executable, "-c", PROBE, "run", str(FLAGSHIP), "--cycles", "1")
    # Compiled modules are kept, as they are where specc is installed.
    kept = {"OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": ""}
    begin_s = monotonic()
    ran = subprocess.run(command, check=True, capture_output=True, env={**os.environ, **kept})
    marks = json.loads(ran.stdout)
    return {name: (wall_s - begin_s, cpu_s) for name, (wall_s, cpu_s) in marks.items()}


if __name__ == "__main__":
    main()
