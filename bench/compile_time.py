"""How long the compiler takes: whole processes, its phases, and systems of more and more states.

Every process is warm, its files having been read before, and all commands take turns.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

import specc.checks
import specc.emit
import specc.lower
import specc.resolve.loader
from bench.harness.building import FLAGSHIP
from bench.harness.processes import Times, in_turns
from bench.harness.stopwatch import Places, Stopwatch
from bench.harness.synthetic import ring
from bench.harness.tables import table
from bench.harness.timing import undisturbed
from specc import pipeline

PHASES: Places = {
    "read": ((specc.resolve.loader.Loader, "load"),),
    "shape": ((specc.resolve.loader, "shape"),),
    "resolve": ((pipeline, "resolve"),),
    "check": ((specc.checks, "run_checks"),),
    "lower": ((specc.lower, "lower"),),
    "fill templates": ((specc.emit, "fill_templates"),),
    "format": ((specc.emit, "format_files"),),
}
WHOLE = "all"
BARE, PYDANTIC = "python -c pass", "import pydantic"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    options = _parser().parse_args(arguments)
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        print(processes(Path(scratch), options.repeats))
        print(phases(Path(scratch), options.states, options.repeats))


def processes(scratch: Path, repeats: int) -> str:
    """Whole processes that validate and build the flagship, beside the least that Python takes."""
    python, spec = sys.executable, str(FLAGSHIP)
    found = in_turns(
        {
            BARE: lambda _: (python, "-c", "pass"),
            PYDANTIC: lambda _: (python, "-c", "import pydantic"),
            "specc validate": lambda _: (python, "-m", "specc", "validate", spec),
            "specc build": lambda n: (
                *(python, "-m", "specc", "build", spec),
                *("--out", str(scratch / f"build_{n}")),
            ),
        },
        repeats,
    )
    rows = [(name, *_in_ratio(times, found)) for name, times in found.items()]
    head = ("process", "wall, ms", "x bare", "x pydantic", "CPU, ms", "x bare", "x pydantic")
    return table(f"Whole processes, flagship, files read before, median of {repeats}", head, rows)


def phases(scratch: Path, sizes: Sequence[int], repeats: int) -> str:
    """Phases of a build in this process: of the flagship and of machines of many states."""
    specs = {"flagship": FLAGSHIP}
    for size in sizes:
        specs[f"{size} states"] = scratch / f"ring_{size}.yaml"
        specs[f"{size} states"].write_text(ring(size), encoding="utf-8")
    columns = [_phase_times(spec, repeats) for spec in specs.values()]
    rows = [
        (name, *(f"{1e3 * column[name]:.1f}" for column in columns)) for name in (*PHASES, WHOLE)
    ]
    title = f"Phases of a build in one process without its start, ms, median of {repeats}"
    return table(title, ("phase", *specs), rows)


def _phase_times(spec: Path, repeats: int) -> dict[str, float]:
    """Median seconds of each phase; what no phase has is part of the whole."""
    runs: list[dict[str, float]] = []
    for number in range(repeats + 1):
        stopwatch = Stopwatch(perf_counter)
        with undisturbed(), stopwatch.watching(PHASES):
            built = stopwatch.timed("rest", pipeline.build)(str(spec))
        if not built.result.ok:
            raise ValueError(f"{spec}: {[f.message for f in built.result.diagnostics]}")
        if number:  # the first build imports what it needs
            runs.append({**stopwatch.seconds, WHOLE: sum(stopwatch.seconds.values())})
    return {name: median(run.get(name, 0.0) for run in runs) for name in (*PHASES, WHOLE)}


def _in_ratio(times: Times, found: dict[str, Times]) -> tuple[str, ...]:
    bare, pydantic = found[BARE], found[PYDANTIC]
    return (
        f"{times.wall_ms:.0f}",
        f"{times.wall_ms / bare.wall_ms:.1f}",
        f"{times.wall_ms / pydantic.wall_ms:.1f}",
        f"{times.cpu_ms:.0f}",
        f"{times.cpu_ms / bare.cpu_ms:.1f}",
        f"{times.cpu_ms / pydantic.cpu_ms:.1f}",
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    add = parser.add_argument
    add("--repeats", type=int, default=7, help="of each process and of each build")
    add("--states", type=int, nargs="*", default=[10, 100, 1000], help="of the growing machine")
    return parser


if __name__ == "__main__":
    main()
