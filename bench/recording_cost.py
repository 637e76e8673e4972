"""What recording costs: CPU time of the flagship with and without it, in turns, and file size.

All runs go on in one process by turns, so that whatever else the machine does meets them alike;
then all again, and of each turn the shortest time counts. Everything is recorded as in any run:
steps, images, poses, models, snapshots. What the recording's own thread would do is done at the end
of a turn, and there are no worker threads.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Semaphore, Thread
from time import process_time
from typing import Any
from unittest.mock import patch

from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion, View
from specc_runtime.environment import open_judge, open_plant
from specc_runtime.interruption import Interruption
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.recording import log
from specc_runtime.recording.recorder import Recorder
from specc_runtime.session import Session

from bench.harness.building import FLAGSHIP, generate
from bench.harness.tables import table

TURN_S = 0.5
"""Simulated time."""
KINDS: Mapping[str, Mapping[str, Any]] = {
    "--record-images none": {"record_images": "none"},
    "--record": {},
    "--record-images full": {"record_images": "full"},
    "--record-exact": {"record_exact": True},
}


class Run:
    """A run of the flagship that goes on turn by turn; see `Companion`."""

    period_s = TURN_S

    def __init__(self, options: Options) -> None:
        """One that has made its first turn, in which it loads what it needs."""
        self._go, self._done = Semaphore(0), Semaphore(0)
        self._log: log.Log | None = None
        self._thread = Thread(target=self._run, args=(options,))
        self._thread.start()
        self._done.acquire()

    def _run(self, options: Options) -> None:
        system = load_system(options.directory, options.base)
        plant, clock = open_plant(system, options.base), WallClock()
        recorder = Recorder(options, system, plant, clock) if options.record else None
        judge = open_judge(system, plant)
        session = Session(options, system, plant, judge, clock, Interruption(), recorder)
        others: list[Companion] = [recorder] if recorder else []
        self._log = recorder.log if recorder else None
        try:
            session.run([*others, self])
        finally:
            plant.close()
            for other in others:
                other.close()
            self._done.release()

    def tick(self, view: View) -> None:
        """End a turn, and wait for the next one."""
        if self._log is not None:
            self._log.flush()
        self._done.release()
        self._go.acquire()

    def turn(self) -> float:
        """CPU seconds of a turn."""
        begin_s = process_time()
        self._go.release()
        self._done.acquire()
        return process_time() - begin_s

    def close(self) -> None:
        """End it after the last turn."""
        self._go.release()
        self._thread.join()


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--duration", type=float, default=20.0, help="simulated seconds")
    parser.add_argument("--rounds", type=int, default=5, help="how often all runs are made")
    options = parser.parse_args(arguments)
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        files = {kind: Path(scratch, f"{i}.mcap") for i, kind in enumerate(KINDS)}
        rounds = [_round(Path(scratch), files, options.duration) for _ in range(options.rounds)]
        sizes_mb = {kind: file.stat().st_size / 1e6 for kind, file in files.items()}
    without, *recorded = (
        sum(map(min, zip(*runs, strict=True))) for runs in zip(*rounds, strict=True)
    )
    rows = [
        (
            kind,
            f"{cost:.2f}",
            f"{100.0 * (cost / without - 1.0):.1f}",
            f"{sizes_mb[kind] * 60.0 / options.duration:.1f}",
        )
        for kind, cost in zip(KINDS, recorded, strict=True)
    ]
    title = "Recording the flagship, images, snapshots and all; without start and end of runs"
    head = ("", "CPU, s", "more, %", "MB in a minute")
    print(table(title, head, [("not recorded", f"{without:.2f}", "", ""), *rows]))


def _round(scratch: Path, files: Mapping[str, Path], duration_s: float) -> list[list[float]]:
    """The CPU seconds of all turns of each run, the one that is not recorded first."""
    with patch.object(log, "INTERVAL_S", 1e6):
        runs: list[Run] = []
        for kind, more in [("", {}), *KINDS.items()]:
            # A run has code of its own: what is recorded has other methods.
            package = generate(FLAGSHIP, scratch / f"package{len(runs)}")
            asked = {"duration_s": duration_s, "inline": True, "record": files.get(kind), **more}
            runs.append(Run(Options(package, FLAGSHIP.parent, **asked)))
        times: list[list[float]] = [[] for _ in runs]
        order = list(enumerate(runs))
        for index in range(round(duration_s / TURN_S) - 1):
            for which, run in order if index % 2 else order[::-1]:
                times[which].append(run.turn())
        for run in runs:
            run.close()
    return times


if __name__ == "__main__":
    main()
