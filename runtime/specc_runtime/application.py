"""The command that runs a generated system, from options to exit code."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion
from specc_runtime.loading import load_class, load_system
from specc_runtime.options import Options, UsageError
from specc_runtime.plants.errors import PlantError
from specc_runtime.report import check_writable, write
from specc_runtime.session import Session
from specc_runtime.system import System
from specc_runtime.wiring import without_source

FULFILLED, UNFULFILLED, WRONG_USAGE = 0, 1, 2


def execute(options: Options) -> int:
    """Run what the options ask for; faults and errors go to standard error."""
    clock = WallClock()
    plant = None
    companions: list[Companion] = []
    try:
        for file in (options.report, options.video):
            if file is not None:
                check_writable(file)
        system = load_system(options.directory, options.base)
        plant = open_plant(system, options)
        session = _session(options, system, plant, clock)
        _accompany(companions, session, options, system, plant, clock)
        session.run(companions)
    except (UsageError, PlantError) as error:
        print(f"error: {error}", file=sys.stderr)
        return WRONG_USAGE
    finally:
        for companion in companions:
            companion.close()
        if plant is not None:
            plant.close()
    return _conclude(session, options)


def open_plant(system: System, options: Options) -> Any:
    """The system's plant, reset with the seed and its scene set; None if it has none.

    Raises PlantError for a model that does not fit, UsageError for a scene that is not there.
    """
    spec = system.plant
    if spec is None:
        _refuse_devices(system)
        return None
    from specc_runtime.plants.mujoco import MujocoPlant

    model = str(options.base / spec.model)
    plant = MujocoPlant(model, spec.sensors, spec.actuators, renderer=options.renderer)
    plant.reset(options.seed)
    if system.task is not None and system.task.scene:
        load_class(system.task.scene)().place(plant, np.random.default_rng(options.seed))
    return plant


def _refuse_devices(system: System) -> None:
    """Raises UsageError if subsystems of a system without a plant read what nobody sends."""
    if missing := without_source(system):
        raise UsageError(
            f"{system.name} has no plant, and nothing else measures {', '.join(missing)}; "
            "add `plant:` to the specification"
        )


def _session(options: Options, system: System, plant: Any, clock: WallClock) -> Session:
    if options.cycles is not None and system.task is None:
        raise UsageError(f"--cycles: {system.name} has no task; use --duration")
    judge = load_class(system.task.judge)(plant) if system.task and system.task.judge else None
    return Session(options, system, plant, judge, clock)


def _accompany(
    companions: list[Companion],
    session: Session,
    options: Options,
    system: System,
    plant: Any,
    clock: WallClock,
) -> None:
    if (options.video or options.viewer) and plant is None:
        raise UsageError(f"--video and --viewer: {system.name} has no plant to look at")
    if options.viewer:
        from specc_runtime.viewer import Viewer

        companions.append(Viewer(plant, clock, session.interruption.request))
    if options.video is not None:
        from specc_runtime.video import Video

        companions.append(Video(options.video, plant, system.tick_s))
    if not options.quiet:
        from specc_runtime.progress.bar import progress

        companions.append(progress(clock))


def _conclude(session: Session, options: Options) -> int:
    report = session.report()
    if options.quiet:
        for fault in report.faults:
            print(f"fault: {fault['subsystem']}: {fault['message']}", file=sys.stderr)
    else:
        from specc_runtime.progress.summary import show

        show(report)
    if options.report is not None:
        try:
            write(report, options.report)
        except OSError as error:
            print(f"error: cannot write {options.report}: {error.strerror}", file=sys.stderr)
            return WRONG_USAGE
    if session.interruption.requested:
        return session.interruption.exit_code
    return FULFILLED if session.fulfilled else UNFULFILLED
