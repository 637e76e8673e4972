"""How long analysis takes: synthetic machines of more and more states and rows, by phase.

Every machine has all its states in one subsystem, and rows that ask about modes and freshness.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

import specc.checks
import specc.resolve.loader
from bench.harness.stopwatch import Places, Stopwatch
from bench.harness.synthetic import machine
from bench.harness.tables import table
from bench.harness.timing import undisturbed
from specc import pipeline

PHASES: Places = {
    "read": ((specc.resolve.loader.Loader, "load"),),
    "shape": ((specc.resolve.loader, "shape"),),
    "resolve": ((pipeline, "resolve"),),
    "check": ((specc.checks, "run_checks"),),
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--states", type=int, nargs="*", default=[10, 100, 1000, 2000])
    parser.add_argument("--rows", type=int, nargs="*", default=[2, 4, 8])
    options = parser.parse_args(arguments)
    lines = []
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        for states in options.states:
            for rows in options.rows:
                spec = Path(scratch, f"machine_{states}_{rows}.yaml")
                spec.write_text(machine(states, rows), encoding="utf-8")
                lines.append(_line(states, rows, _times(spec, options.repeats)))
    head = ("states", "rows", *(f"{phase}, ms" for phase in PHASES), "without reading, us/state")
    title = f"Analysis in one process without its start, median of {options.repeats}"
    print(table(title, head, lines))


def _times(spec: Path, repeats: int) -> dict[str, float]:
    """Median seconds of each phase."""
    runs: list[dict[str, float]] = []
    for _ in range(repeats + 1):
        stopwatch = Stopwatch(perf_counter)
        with undisturbed(), stopwatch.watching(PHASES):
            result = stopwatch.timed("rest", pipeline.compile_spec)(str(spec))
        if result.diagnostics:
            raise ValueError(f"{spec}: {[f.message for f in result.diagnostics]}")
        runs.append(dict(stopwatch.seconds))
    # The first run imports what it needs.
    return {phase: median(run[phase] for run in runs[1:]) for phase in PHASES}


def _line(states: int, rows: int, times: dict[str, float]) -> tuple[str, ...]:
    without = sum(seconds for phase, seconds in times.items() if phase != "read")
    each = f"{1e6 * without / states:.0f}"
    return str(states), str(rows), *(f"{1e3 * times[phase]:.1f}" for phase in PHASES), each


if __name__ == "__main__":
    main()
