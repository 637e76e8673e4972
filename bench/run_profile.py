"""Where the time of a run of the flagship goes, for each renderer, with worker threads and inline.

The parts of a run are timed from outside. Percentages are of the main thread; what a worker
computes at the same time stands below them, on the same scale. While a worker holds the
interpreter, the main thread's wall time goes on in whatever part waits for it. Timing costs about
1 us for each call.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time, thread_time
from typing import Any, Literal, get_args

from specc_runtime.application import open_judge, open_plant
from specc_runtime.cells.irp6_picking import PickJudge
from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion
from specc_runtime.cycles import Cycles
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import noise
from specc_runtime.plants.mujoco.cameras import Cameras
from specc_runtime.plants.mujoco.driving import Actuator
from specc_runtime.plants.mujoco.plant import MujocoPlant
from specc_runtime.progress.bar import Lines
from specc_runtime.records import RecordDigest
from specc_runtime.runner import WorkerRunner
from specc_runtime.sampling import Port
from specc_runtime.session import Session
from specc_runtime.statistics import Statistics
from specc_runtime.system import System
from specc_runtime.track import Track
from specc_runtime.wiring import WORKER_PERIOD_S

from bench.harness.building import FLAGSHIP, generate
from bench.harness.stopwatch import Places, Stopwatch
from bench.harness.tables import table

Renderer = Literal["gl", "raycast"]
PLACES: Places = {
    "physics": ((MujocoPlant, "advance"),),
    "drives": ((Actuator, "drive"),),
    "cameras": ((Cameras, "frame"),),
    "noise of depth": ((noise, "kinect_depth"),),
    "sensors": ((MujocoPlant, "sample"),),
    "buffers": ((Track, "commit"), (Port, "deliver")),
    "waiting for worker": ((WorkerRunner, "outcome"),),
    "records, hashing": ((RecordDigest, "__call__"),),
    "statistics": ((Statistics, "__call__"), (Cycles, "__call__")),
    "judge": ((PickJudge, "observe"), (PickJudge, "watch"), (PickJudge, "end_cycle")),
    "progress": ((Lines, "tick"), (Session, "view")),
}
REST = "executor"
CLOCKS: dict[str, Callable[[], float]] = {"wall": perf_counter, "cpu": thread_time}


@dataclass(frozen=True, slots=True)
class Profile:
    """Seconds by section, in the main thread and in workers; CPU seconds of all threads."""

    name: str
    simulated_s: float
    wall_s: float
    cpu_s: float
    sections: dict[str, float]
    beside: dict[str, float]
    calls: dict[str, int]


TOTALS: dict[str, Callable[[Profile], float]] = {
    "wall, s": lambda one: one.wall_s,
    "CPU, s": lambda one: one.cpu_s,
    "simulated, s": lambda one: one.simulated_s,
    "times real time": lambda one: one.simulated_s / one.wall_s,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    options = _parser().parse_args(arguments)
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        package = generate(FLAGSHIP, Path(scratch))
        profiles = []
        for renderer in options.renderers:
            for inline in (False, True):
                try:
                    profiles.append(
                        profile(package, renderer, inline, options.duration, options.clock)
                    )
                except PlantError as error:
                    print(f"{renderer}: {error}\n")
                    break
    if profiles:
        print(report(profiles, options.clock))


def profile(
    package: Path, renderer: Renderer, inline: bool, duration_s: float | None, clock: str = "wall"
) -> Profile:
    """One run with seed 0. Raises PlantError where the renderer is not there."""
    options = Options(
        package,
        FLAGSHIP.parent,
        duration_s=duration_s,
        cycles=None if duration_s else 1,
        renderer=renderer,
        inline=inline,
        quiet=True,
    )
    system = load_system(package, options.base)
    plant = open_plant(system, options.base, options.seed, options.renderer)
    try:
        plant.picture("kinect", 64, 48)  # opens the renderer, which is not part of a run
        name = f"{renderer}, {'inline' if inline else 'worker'}"
        return _timed_run(name, system, plant, options, CLOCKS[clock])
    finally:
        plant.close()


def report(profiles: Sequence[Profile], clock: str = "wall") -> str:
    """Percent of the main thread's time in each run, and how much faster than real time it was.

    Calls are those of the last run.
    """
    names = list(dict.fromkeys(name for one in profiles for name in one.sections))
    names.sort(key=lambda name: -profiles[0].sections.get(name, 0.0))
    rows = [
        (
            name,
            *(_percent(one, one.sections.get(name)) for one in profiles),
            *_calls(name, profiles[-1]),
        )
        for name in names
    ]
    beside = sorted({name for one in profiles for name in one.beside})
    rows += [
        (
            f"({name}, in a worker)",
            *(_percent(one, one.beside.get(name)) for one in profiles),
            *("", ""),
        )
        for name in beside
    ]
    rows += [
        (name, *(f"{number(one):.2f}" for one in profiles), "", "")
        for name, number in TOTALS.items()
    ]
    return table(
        f"Run of the flagship, % of the {clock} time of the main thread",
        ("", *(one.name for one in profiles), "calls", "us each"),
        rows,
    )


def _percent(one: Profile, seconds: float | None) -> str:
    return "" if seconds is None else f"{100.0 * seconds / sum(one.sections.values()):.1f}"


def _calls(name: str, one: Profile) -> tuple[str, str]:
    """Number of calls in a run and what each took, without what was called in turn."""
    count = one.calls.get(name, 0)
    return str(count), f"{1e6 * one.sections[name] / count:.1f}" if count else ""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    add = parser.add_argument
    add("--duration", type=float, help="simulated seconds, by default one pick")
    add("--renderers", nargs="+", choices=get_args(Renderer), default=get_args(Renderer))
    add("--clock", choices=tuple(CLOCKS), default="wall", help="of threads; CPU forgets waiting")
    return parser


def _timed_run(
    name: str, system: System, plant: Any, options: Options, now_s: Callable[[], float]
) -> Profile:
    clock = WallClock()
    stopwatch, workers = Stopwatch(now_s), Stopwatch(now_s)
    with stopwatch.watching(PLACES):
        judge = open_judge(system, plant)
        session = Session(options, system, plant, judge, clock)
        for item in system.subsystems:
            step, slow = item.subsystem.step, item.subsystem.period_s >= WORKER_PERIOD_S
            watch = workers if slow and not options.inline else stopwatch
            item.subsystem.step = watch.timed(item.subsystem.name, step)  # type: ignore[method-assign]  # timed
        companions: list[Companion] = [Lines(clock)]
        begin_s = process_time()
        with redirect_stderr(StringIO()):
            stopwatch.timed(REST, session.run)(companions)
        cpu_s = process_time() - begin_s
    found = session.report()
    seconds, beside = dict(stopwatch.seconds), dict(workers.seconds)
    calls = dict(stopwatch.calls)
    return Profile(name, found.simulated_s, found.wall_s, cpu_s, seconds, beside, calls)


if __name__ == "__main__":
    main()
