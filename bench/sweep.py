"""How near a sweep comes to what its runs take, and what it adds to each.

The ideal is what the same runs take one after another in one process, divided by the number of
processes. Both are measured in turns, so that what else the machine does touches both; but wall
time says something only on a machine that does nothing else, CPU time on any.
"""

from __future__ import annotations

import argparse
import csv
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.harness.tables import table
from specc.tools.sweep.running import SweepJob, Workspace, close_workspace, open_workspace, run_job
from specc.tools.sweep.sweeping import bundle_of, inputs_of

ROOT = Path(__file__).resolve().parents[1]
SPEC = ROOT / "specs" / "conveyor_gate.yaml"
RUNS, TURNS = 200, 4
DURATION_S = 90
_EXTENT = {
    "cycles": None,
    "duration_s": DURATION_S,
    "cycle_limit_s": None,
    "renderer": "auto",
    "check_operators": False,
}


def children_s() -> float:
    """CPU time of the processes that have been started and are over (s)."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def alone(folder: Path, seeds: range) -> float:
    """Wall time of runs one after another, without what comes before the first (s)."""
    from specc import pipeline

    built = pipeline.build(str(SPEC))
    assert built.result.system is not None
    inputs = inputs_of(str(SPEC), built.result.sources, built.result.system)
    code = {f"{built.system}/{name}": text for name, text in built.files.items()}
    open_workspace("alone", Workspace(folder, bundle_of(code, inputs)))
    jobs = [SweepJob("alone", built.system, {}, seed, _EXTENT, 600.0) for seed in seeds]
    run_job(jobs[0])
    begun_s = time.perf_counter()
    for job in jobs:
        run_job(job)
    took_s = time.perf_counter() - begun_s
    close_workspace("alone")
    return took_s


def swept(folder: Path, seeds: range, workers: int) -> float:
    """Wall time of the whole command, from the shell to the last plot (s)."""
    command = [sys.executable, "-m", "specc", "sweep", str(SPEC), "--out", str(folder / "out")]
    command += ["--seeds", f"{seeds.start}:{seeds.stop}", "--duration", str(DURATION_S)]
    command += ["--workers", str(workers)]
    begun_s = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    took_s = time.perf_counter() - begun_s
    with (folder / "out" / "runs.csv").open(encoding="utf-8") as file:
        assert sum(1 for _ in csv.reader(file)) == 1 + len(seeds)
    return took_s


def main() -> None:
    """Measure in turns: a quarter of the runs alone, then all of them as one sweep."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    workers = len(os.sched_getaffinity(0))
    lone_s = swept_s = swept_cpu_s = 0.0
    begun_s = children_s()
    with TemporaryDirectory() as scratch:
        for turn in range(TURNS):
            if turn == TURNS // 2:
                before_s = children_s()
                swept_s = swept(Path(scratch), range(RUNS), workers)
                swept_cpu_s = children_s() - before_s
            part = RUNS // TURNS
            lone_s += alone(Path(scratch, f"turn{turn}"), range(turn * part, (turn + 1) * part))
    lone_cpu_s = children_s() - begun_s - swept_cpu_s
    ideal_s = lone_s / workers
    share, cpu_share = ideal_s / swept_s, lone_cpu_s / swept_cpu_s
    rows = [
        ["one after another", f"{lone_s:.1f} s", "", f"{lone_cpu_s:.1f} s", ""],
        [f"ideal of {workers} processes", f"{ideal_s:.1f} s", "", f"{lone_cpu_s:.1f} s", ""],
        [
            "specc sweep, all of the command",
            *(f"{swept_s:.1f} s", f"{100 * share:.1f} %"),
            *(f"{swept_cpu_s:.1f} s", f"{100 * cpu_share:.1f} %"),
        ],
    ]
    head = ["", "wall time", "of the ideal", "CPU time", "of the ideal"]
    print(
        table(
            f"{RUNS} runs of {DURATION_S} s; one after another without the start of their process",
            head,
            rows,
        )
    )


if __name__ == "__main__":
    main()
