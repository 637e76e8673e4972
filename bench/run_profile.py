"""Where the time of a run of the flagship goes, for each renderer, with worker threads and inline.

The parts of a run are timed from outside, in CPU time of their threads. Percentages are of the main
thread; what other threads compute at the same time stands below them, on the same scale. Timing
costs about 1 us for each call.

No run can be shorter than its bound: the CPU time of the main thread, that of the others, or that
of the whole process (OpenGL in software has threads of its own) over the number of cores, whichever
is longest. The table tells which part of the bound a run comes to.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time, thread_time
from typing import Any, Literal, get_args

from specc_runtime.cells.irp6_picking import PickJudge
from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion
from specc_runtime.environment import open_judge, open_plant
from specc_runtime.interruption import Interruption
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import noise
from specc_runtime.plants.mujoco.driving import Actuator
from specc_runtime.plants.mujoco.gl import GlRenderer
from specc_runtime.plants.mujoco.plant import MujocoPlant
from specc_runtime.plants.mujoco.raycast import RaycastRenderer
from specc_runtime.progress.bar import Lines
from specc_runtime.records import RecordDigest
from specc_runtime.report import Statistics
from specc_runtime.sampling import Port
from specc_runtime.session import Session
from specc_runtime.system import System
from specc_runtime.task import Cycles
from specc_runtime.track import Track

from bench.harness.building import FLAGSHIP, generate
from bench.harness.stopwatch import Places, Stopwatch
from bench.harness.tables import table

Renderer = Literal["gl", "raycast"]
PLACES: Places = {
    "physics": ((MujocoPlant, "advance"),),
    "drives": ((Actuator, "drive"),),
    "rendering": ((GlRenderer, "render"), (RaycastRenderer, "render")),
    "noise of depth": ((noise, "grain"), (noise, "kinect_depth")),
    "sensors": ((MujocoPlant, "sample"),),
    "buffers": ((Track, "commit"), (Port, "deliver")),
    "records, hashing": ((RecordDigest, "__call__"),),
    "statistics": ((Statistics, "__call__"), (Cycles, "__call__")),
    "judge": ((PickJudge, "observe"), (PickJudge, "watch"), (PickJudge, "end_cycle")),
    "progress": ((Lines, "tick"), (Session, "view")),
}
REST = "executor"


@dataclass(frozen=True, slots=True)
class Profile:
    """CPU seconds by section, in the main thread and beside it, and of the whole process."""

    name: str
    simulated_s: float
    wall_s: float
    cpu_s: float
    sections: dict[str, float]
    beside: dict[str, float]
    calls: dict[str, int]

    @property
    def bound_s(self) -> float:
        """Wall time that a run of this work takes at least."""
        threads = sum(self.sections.values()), sum(self.beside.values())
        return max(*threads, self.cpu_s / (os.cpu_count() or 1))


TOTALS: dict[str, Callable[[Profile], float]] = {
    "wall, s": lambda one: one.wall_s,
    "CPU, s": lambda one: one.cpu_s,
    "bound, s": lambda one: one.bound_s,
    "part of the bound, %": lambda one: 100.0 * one.bound_s / one.wall_s,
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
                    profiles.append(profile(package, renderer, inline, options.duration))
                except PlantError as error:
                    print(f"{renderer}: {error}\n")
                    break
    if profiles:
        print(report(profiles))


def profile(package: Path, renderer: Renderer, inline: bool, duration_s: float | None) -> Profile:
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
        return _timed_run(name, system, plant, options)
    finally:
        plant.close()


def report(profiles: Sequence[Profile]) -> str:
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
            f"({name}, beside)",
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
        "Run of the flagship, % of the CPU time of the main thread",
        ("", *(one.name for one in profiles), "calls", "us each"),
        rows,
    )


def _percent(one: Profile, seconds: float | None) -> str:
    return "" if seconds is None else f"{100.0 * seconds / sum(one.sections.values()):.1f}"


def _calls(name: str, one: Profile) -> tuple[str, str]:
    """Number of calls in a run and what each took, without what was called in turn."""
    count = one.calls.get(name, 0)
    return str(count), f"{1e6 * one.sections.get(name, 0.0) / count:.1f}" if count else ""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    add = parser.add_argument
    add("--duration", type=float, help="simulated seconds, by default one pick")
    add("--renderers", nargs="+", choices=get_args(Renderer), default=get_args(Renderer))
    return parser


def _timed_run(name: str, system: System, plant: Any, options: Options) -> Profile:
    clock = WallClock()
    stopwatch = Stopwatch(thread_time)
    with stopwatch.watching(PLACES):
        judge = open_judge(system, plant)
        session = Session(options, system, plant, judge, clock, Interruption())
        for item in system.subsystems:
            step = stopwatch.timed(item.subsystem.name, item.subsystem.step)
            item.subsystem.step = step  # type: ignore[method-assign]  # timed
        companions: list[Companion] = [Lines(clock)]
        begin_s = process_time()
        with redirect_stderr(StringIO()):
            stopwatch.timed(REST, session.run)(companions)
        cpu_s = process_time() - begin_s
    found = session.report()
    seconds, beside = dict(stopwatch.seconds), dict(stopwatch.beside)
    calls = dict(stopwatch.calls)
    return Profile(name, found.simulated_s, found.wall_s, cpu_s, seconds, beside, calls)


if __name__ == "__main__":
    main()
