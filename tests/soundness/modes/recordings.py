"""Recordings of random machines with modes: replayed, and their inputs given to the interpreter."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

from specc_runtime.cycle import Executor
from specc_runtime.options import Options
from specc_runtime.recording.recorder import Recorder
from specc_runtime.recording.replay import replay
from specc_runtime.rehearsal import Rehearsal, Reports, Scripted
from specc_runtime.timing import RealTime, Timing

from specc import output
from specc.pipeline import Build
from tests.recording.runs import messages
from tests.runtime.driven import DrivenClock
from tests.soundness.modes.hierarchical import Failure, Machine, Tree, Written
from tests.soundness.modes.random_machines import SPORADIC, STEADY
from tests.soundness.modes.scripted import NAME, control_of, values
from tests.soundness.values import same

REPORTED = {**STEADY, **SPORADIC, "on": "bool"}


class Plant(Scripted):
    """Time passes in it by as many base ticks as are over."""

    tick_s = 0.0

    def advance(self, duration_s: float) -> None:
        self._tick += round(duration_s / self.tick_s)


def package_of(built: Build, folder: Path) -> Path:
    """The generated code on the disk."""
    assert not list(output.write(folder / built.system, built.files))
    return folder / built.system


def reports(rehearsal: Rehearsal, rng: Random, ticks: int) -> Reports:
    """What the sensors report at each base tick; many values stay for a while."""
    often = rng.random()
    found: dict[str, list[tuple[int, Any]]] = {name: [] for name in rehearsal.sensors}
    for name, reported in found.items():
        element = name.rpartition(".")[2]
        for tick in range(ticks):
            if tick == 0 or rng.random() < often:
                reported.append((tick, values(rng, {element: REPORTED[element]})[element]))
    return found


def record(package: Path, folder: Path, rng: Random, ticks: int, stalls: float) -> Path:
    """Record a run; with `stalls` in real time, where periods are skipped."""
    rehearsal, clock = Rehearsal(package, folder), DrivenClock()
    system, file = rehearsal.again(), folder / "run.mcap"
    plant = Plant(rehearsal._forms)
    plant.tick_s = system.tick_s
    plant.follow(reports(rehearsal, rng, ticks), 0)
    texts = {"spec.yaml": (folder / "spec.yaml").read_text(encoding="utf-8")}
    options = Options(package, record=file, record_exact=True, texts=texts)
    recorder = Recorder(options, system, plant, clock)
    timing: Timing = RealTime(clock)
    executor = Executor(system, plant, [recorder], inline=True, clock=clock, timing=timing)
    while executor.tick < ticks and executor.advance():
        if rng.random() < stalls:
            clock.busy(rng.expovariate(0.4) * system.tick_s)
    executor.finish()
    recorder.close()
    return file


def replayed(package: Path, folder: Path, file: Path) -> Iterator[str]:
    """What a replay does otherwise."""
    outcomes, _ = replay(package, folder, file)
    for outcome in outcomes:
        if outcome.difference or outcome.unknown:
            yield f"replay: {outcome.difference or outcome.unknown}"


def reproduced(tree: Tree, file: Path) -> Iterator[str]:
    """What the interpreter does otherwise with the inputs of a recording."""
    machine = Machine(Written(control_of(tree)))
    for _, told in messages(file)[f"/{NAME}"]:
        if "fault" in told:
            return
        inputs = {(p, n): value for p, part in told["x"].items() for n, value in part.items()}
        fresh = {tuple(key.split(".")) for key, is_fresh in told["fresh"].items() if is_fresh}
        step = machine.step(inputs, fresh, told.get("skipped", 0))  # type: ignore[arg-type]  # of JSON
        if isinstance(step, Failure):
            yield f"recorded {json.dumps(told)}, interpreted {step}"
            return
        found = {"state": step.state, **dict(step.memory)}
        wanted = {"state": told["state"], **told["memory"]}
        wrong = [n for n, value in found.items() if n in wanted and not same(value, wanted[n])]
        if wrong or bool(told["cause"]) != bool(step.cause):
            yield f"stamp {told['stamp']}: {wrong} recorded {json.dumps(told)}, interpreted {step}"
            return
