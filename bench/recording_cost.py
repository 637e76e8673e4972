"""What recording costs: CPU time of the flagship with and without it, in turns, and file size.

Two runs in one process go on by turns, so that whatever else the machine does meets both alike;
then both again, and of each turn the shortest time counts. What the recording's own thread would do
is done at the end of a turn. Steps, images, poses and snapshots are recorded as in any run.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from unittest.mock import patch

from specc_runtime.application import open_judge, open_plant
from specc_runtime.clock import WallClock
from specc_runtime.companion import View
from specc_runtime.cycle import Executor
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.recording import log
from specc_runtime.recording.recorder import Recorder
from specc_runtime.records import Observer, RecordDigest
from specc_runtime.report import Statistics
from specc_runtime.task import Cycles

from bench.harness.building import FLAGSHIP, generate
from bench.harness.tables import table

TURN_S = 0.5
"""Simulated time."""


@dataclass(slots=True)
class Run:
    """A run of the flagship that goes on turn by turn."""

    executor: Executor
    cycles: Cycles
    recorder: Recorder | None
    tick_s: float

    @classmethod
    def of(cls, package: Path, file: Path | None, exact: bool) -> Run:
        """A run at its beginning, recorded in a file if there is one."""
        base = FLAGSHIP.parent
        system = load_system(package, base)
        plant = open_plant(system, base)
        recorder = None
        if file is not None:
            options = Options(package, base, record=file, record_exact=exact)
            recorder = Recorder(options, system, plant, WallClock())
        cycles = Cycles(system, open_judge(system, plant), lambda: executor.time_s)
        observers: list[Observer] = [RecordDigest(), Statistics(system), cycles]
        if recorder is not None:
            observers.insert(0, recorder)
        executor = Executor(system, plant, observers, inline=True)
        return cls(executor, cycles, recorder, system.tick_s)

    def turn(self) -> float:
        """CPU seconds of a turn."""
        begin_s = process_time()
        recorder, executor = self.recorder, self.executor
        every = round(recorder.period_s / self.tick_s) if recorder else 1
        for _ in range(round(TURN_S / self.tick_s)):
            executor.advance()
            self.cycles.observe()
            if recorder is not None and executor.tick % every == 0:
                recorder.tick(View(executor.time_s, {}, (), None, None))
        if recorder is not None:
            recorder.log.flush()
        return process_time() - begin_s

    def close(self) -> None:
        """End it."""
        self.executor.__exit__()
        if self.recorder is not None:
            self.recorder.close()


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--duration", type=float, default=20.0, help="simulated seconds")
    parser.add_argument("--rounds", type=int, default=3, help="how often both runs are made")
    options = parser.parse_args(arguments)
    rows = []
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        folders = [Path(scratch, name) for name in ("without", "with")]
        for folder in folders:
            folder.mkdir()
        packages = [generate(FLAGSHIP, folder) for folder in folders]
        for name, exact in (("--record", False), ("--record-exact", True)):
            file = Path(scratch, "run.mcap")
            rounds = [
                _turns(packages, file, options.duration, exact) for _ in range(options.rounds)
            ]
            without, recorded = (
                sum(map(min, zip(*turns, strict=True))) for turns in zip(*rounds, strict=True)
            )
            minute_mb = file.stat().st_size / 1e6 * 60.0 / options.duration
            rows.append(
                (
                    name,
                    f"{without:.2f}",
                    f"{recorded:.2f}",
                    f"{100.0 * (recorded / without - 1.0):.1f}",
                    f"{minute_mb:.1f}",
                )
            )
    head = ("", "CPU without, s", "with, s", "more, %", "MB in a minute")
    print(
        table(
            "Recording the flagship, images and all, without start and end of the runs", head, rows
        )
    )


def _turns(
    packages: Sequence[Path], file: Path, duration_s: float, exact: bool
) -> tuple[list[float], list[float]]:
    """The CPU seconds of all turns without and with recording."""
    with patch.object(log, "INTERVAL_S", 1e6):
        runs = [Run.of(packages[0], None, exact), Run.of(packages[1], file, exact)]
        times: tuple[list[float], list[float]] = [], []
        for run in runs:
            run.turn()  # with what is loaded in it
        for index in range(round(duration_s / TURN_S) - 1):
            for which in (0, 1) if index % 2 else (1, 0):
                times[which].append(runs[which].turn())
        for run in runs:
            run.close()
    return times


if __name__ == "__main__":
    main()
