"""Inputs of every subsystem, step by step, as they were in a run."""

from __future__ import annotations

import copy
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from specc_runtime.clock import WallClock
from specc_runtime.environment import open_judge, open_plant
from specc_runtime.interruption import Interruption
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.session import Session
from specc_runtime.subsystem import Subsystem

from bench.harness.building import generate

Recorded = dict[str, list[Any]]
"""Copies of the input buffers by the names of the subsystems."""

LARGE_STEPS = 12
"""Steps that are kept of a subsystem that reads images."""


def record(spec: Path, duration_s: float | None) -> Recorded:
    """Inputs of all subsystems in a run of `spec`: for so long, or one cycle."""
    # A method that is put on one object costs all calls to it on objects of that class, for good.
    # So the run has code of its own.
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        return _record(generate(spec, Path(scratch)), spec.parent, duration_s)


def _record(package: Path, base: Path, duration_s: float | None) -> Recorded:
    options = Options(
        package, base, duration_s=duration_s, cycles=None if duration_s else 1, quiet=True
    )
    system = load_system(package, base)
    plant = open_plant(system, options.base, options.seed, options.renderer)
    recorded: Recorded = {}
    try:
        for item in system.subsystems:
            recorded[item.subsystem.name] = _listen(item.subsystem)
        judge = open_judge(system, plant)
        Session(options, system, plant, judge, WallClock(), Interruption()).run()
    finally:
        if plant is not None:
            plant.close()
    return recorded


def _listen(subsystem: Subsystem) -> list[Any]:
    """The list to which each step of the subsystem will add a copy of its inputs."""
    heard: list[Any] = []
    step = subsystem.step
    slow = subsystem.period_s >= 0.1

    def listening_step() -> int:
        if not slow or len(heard) < LARGE_STEPS:
            heard.append(copy.copy(subsystem.x))
        return step()

    subsystem.step = listening_step  # type: ignore[method-assign]  # that is the point
    return heard
