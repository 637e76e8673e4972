"""What contracts cost: each by itself, in the steps of the flagship, and as a share of its run.

Contracts cannot be switched off; here, generated modules are loaded once more and their operators
replaced by the bare functions.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from timeit import repeat
from types import ModuleType
from typing import Any

import numpy as np
from specc_runtime import contracts as c
from specc_runtime.builtins import finite
from specc_runtime.clock import WallClock
from specc_runtime.environment import open_judge, open_plant
from specc_runtime.interruption import Interruption
from specc_runtime.loading import load_system
from specc_runtime.operators.regulator import RegulatorOutput, RegulatorState
from specc_runtime.options import Options
from specc_runtime.plant import Deferred
from specc_runtime.session import Session
from specc_runtime.subsystem import Subsystem

from bench.handwritten import irp_m
from bench.harness.building import FLAGSHIP, fresh, generate, module_of
from bench.harness.recording import record
from bench.harness.rivals import Rival, copied, costs
from bench.harness.tables import table

SIX = np.arange(6.0)
DRIVE = RegulatorOutput(SIX, RegulatorState(*3 * [tuple(SIX)]))
SINGLE: dict[str, tuple[Callable[[Any], Any], Any]] = {
    "as_real": (c.as_real, 0.5),
    "as_vector(6)": (c.as_vector(6), SIX),
    "as_pose": (c.as_pose, np.eye(4)),
    "as_tuple of 6 members": (c.as_tuple(c.as_member("u", "c"), 6), ("u",) * 6),
    "as_record": (
        c.as_record(RegulatorOutput, c_d=c.as_vector(6), state=c.as_instance(RegulatorState)),
        DRIVE,
    ),
    "as_rgb(480, 640)": (c.as_rgb(480, 640), np.zeros((480, 640, 3), np.uint8)),
    "as_depth(480, 640)": (c.as_depth(480, 640), np.zeros((480, 640), np.float32)),
    "finite, a number": (finite, 0.5),
    "finite, six numbers": (finite, SIX.copy()),
    "for comparison: copy of six numbers": (np.ndarray.copy, SIX),
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--duration", type=float, help="simulated seconds, by default one pick")
    parser.add_argument("--budget", type=float, default=4.0, help="seconds for each comparison")
    options = parser.parse_args(arguments)
    print(single())
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        package = generate(FLAGSHIP, Path(scratch))
        print(in_steps(package, options.duration, options.budget))


def single() -> str:
    """One call of each contract."""
    rows = []
    for name, (contract, value) in SINGLE.items():
        calls = 200 if "480" in name else 20_000
        best = min(repeat(partial(contract, value), number=calls, repeat=7)) / calls
        rows.append((name, f"{1e6 * best:.2f}"))
    return table("Contracts, one call", ("contract", "us"), rows)


def in_steps(package: Path, duration_s: float | None, budget_s: float) -> str:
    """Steps of the flagship with and without contracts, and the share of a run."""
    recorded = record(FLAGSHIP, duration_s)
    run_s, samples_s, steps = _run(package, duration_s)
    rows, spent_s = [], samples_s
    for name, inputs in sorted(recorded.items()):
        rivals: dict[str, Callable[[], Any]] = {
            "without": partial(_unchecked, package, name),
            "generated": partial(fresh, package, FLAGSHIP.parent, name),
        }
        if name == "irp.m":
            files = {"irp6": str(FLAGSHIP.parent / "plants" / "irp6_picking.xml")}
            rivals["by hand"] = partial(irp_m.Manipulator, files)
            rivals["by hand, with"] = partial(_checked_by_hand, package, files)
        found = {x.name: x.step_ns for x in costs(_rivals(rivals, inputs), budget_s)}
        added_ns = max(0.0, found["generated"] - found["without"])
        spent_s += 1e-9 * added_ns * steps[name]
        rows += [(name, kind, f"{1e-3 * found[kind]:.1f}") for kind in rivals]
        rows.append((name, "share of the step", f"{added_ns / found['generated']:.1%}"))
    rows.append(("samples", "CPU ms of the run", f"{1e3 * samples_s:.0f}"))
    rows.append(("run", "CPU s", f"{run_s:.2f}"))
    rows.append(("run", "share of contracts", f"{spent_s / run_s:.1%}"))
    title = "Steps of the flagship by themselves, without work cycle and plant, inputs of a run"
    return table(title, ("part", "checks", "us a step"), rows)


def _rivals(made: dict[str, Callable[[], Any]], inputs: Sequence[Any]) -> list[Rival]:
    return [
        Rival(name, make, [copied(type(make().x), buffer) for buffer in inputs])
        for name, make in made.items()
    ]


def _unchecked(package: Path, name: str) -> Subsystem:
    """A generated subsystem whose operators are the bare functions."""
    subsystem = load_system(package, FLAGSHIP.parent).scheduled(name).subsystem
    module = module_of(type(subsystem))
    for known, value in list(vars(module).items()):
        if hasattr(value, "with_function"):
            setattr(module, known, value.__wrapped__)
    if hasattr(module, "finite"):
        module.finite = lambda value: value  # type: ignore[attr-defined]  # of that module
    return subsystem


def _checked_by_hand(package: Path, files: dict[str, str]) -> Any:
    """The hand-written manipulator with the operators of the generated one."""
    generated = module_of(type(fresh(package, FLAGSHIP.parent, "irp.m")))
    spec = importlib.util.spec_from_file_location("irp_m_checked", irp_m.__file__)
    assert spec is not None and spec.loader is not None
    module = ModuleType("irp_m_checked")
    sys.modules["irp_m_checked"] = module
    spec.loader.exec_module(module)
    for known, value in vars(generated).items():
        if hasattr(value, "with_function"):
            setattr(module, known, value)
    return module.Manipulator(files)


def _run(package: Path, duration_s: float | None) -> tuple[float, float, dict[str, int]]:
    """CPU time of a run without workers, that of checking its samples, and steps by subsystem."""
    options = Options(
        package, FLAGSHIP.parent, duration_s=duration_s, cycles=None if duration_s else 1,
        quiet=True, inline=True,
    )  # fmt: skip
    system = load_system(package, FLAGSHIP.parent)
    plant = open_plant(system, options.base, options.seed, options.renderer)
    try:
        session = Session(
            options, system, plant, open_judge(system, plant), WallClock(), Interruption()
        )
        begin = process_time()
        session.run()
        run_s = process_time() - begin
        simulated_s = plant.time_s
        samples_s = 0.0
        for sensor in system.plant.sensors if system.plant else ():
            value = plant.sample(sensor.name)
            value = value.value() if isinstance(value, Deferred) else value
            each = min(repeat(partial(sensor.contract, value), number=100, repeat=5)) / 100
            samples_s += each * simulated_s * (sensor.rate_hz or 500.0)
    finally:
        plant.close()
    steps = {s.subsystem.name: int(simulated_s / s.subsystem.period_s) for s in system.subsystems}
    return run_s, samples_s, steps


if __name__ == "__main__":
    main()
