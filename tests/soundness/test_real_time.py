"""Random systems in real time on a driven clock, with stalls: what is skipped, and what is not.

Where no period is skipped the records are those of simulated time. A step depends on its inputs,
its memory and the number of its period alone: steps that are given these again give the same.
"""

from __future__ import annotations

import copy
from collections import Counter, defaultdict
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from specc_runtime.buffers import slots
from specc_runtime.cycle import Executor
from specc_runtime.faults import UndecidedTransition
from specc_runtime.system import System as Built
from specc_runtime.timing import RealTime

from specc.model.system import System
from tests.runtime.driven import DrivenClock, Elsewhere
from tests.seeds import Seeds, blocks
from tests.soundness.law import marks_of
from tests.soundness.running import (
    Recorder,
    Run,
    Script,
    ScriptedPlant,
    built,
    compiled,
    executed,
    memory_of,
    only_about_machines,
)
from tests.soundness.specifications import specification
from tests.soundness.values import plain, same

TICKS = 60

Left = tuple[int, str, tuple[tuple[str, Any], ...], tuple[tuple[str, Any], ...]]
"""Of a step: row, state, memory, outputs."""
Given = tuple[int, Any, Left]
"""Periods skipped before a step, its inputs, and what it left."""


class Plant(ScriptedPlant):
    """Time passes in it by as many base ticks as are over."""

    def __init__(self, script: Script, tick_s: float) -> None:
        super().__init__(script)
        self._tick_s = tick_s

    def advance(self, duration_s: float) -> None:
        self.tick += round(duration_s / self._tick_s)


def _left(machine: Any, row: int) -> Left:
    sent = tuple((n, plain(getattr(machine.y, n))) for n in machine.sends.get(machine.state, ()))
    return row, machine.state, memory_of(machine), sent


def _noted(made: Built, given: dict[str, list[Given]]) -> None:
    """Have what every step is given, and what it leaves, written down."""
    for scheduled in made.subsystems:
        machine, skipped = scheduled.subsystem, [0]

        def step(
            machine: Any = machine, skipped: list[int] = skipped, own: Any = machine.step
        ) -> int:
            x, periods = copy.copy(machine.x), skipped[0]
            skipped[0] = 0
            row = own()
            given[machine.name].append((periods, x, _left(machine, row)))
            return int(row)

        def skip(periods: int, skipped: list[int] = skipped, own: Any = machine.skip) -> None:
            skipped[0] = periods
            own(periods)

        vars(machine).update(step=step, skip=skip)


def _in_real_time(
    made: Built, plant: Plant | None, random: Random, stalls: float
) -> tuple[Run, Executor]:
    """A run, and what ran it; after some ticks the main thread, or a step elsewhere, is late."""
    clock = DrivenClock()
    run = Run({s.subsystem.name: [] for s in made.subsystems})
    executor = Executor(
        made,
        plant,
        [Recorder(made, run.steps)],
        inline=True,
        clock=clock,
        timing=RealTime(clock),
    )
    for track in executor._tracks.values():
        if random.random() < 0.3 * bool(stalls):
            lasts_s = 2.5 * track.ticks * made.tick_s
            track.runner = Elsewhere(track.runner, clock, partial(random.uniform, 0, lasts_s))
    with np.errstate(all="ignore"):
        while executor.tick < TICKS and executor.advance():
            if random.random() < stalls:
                clock.busy(random.expovariate(0.2) * made.tick_s)
        executor.finish()
    run.commands = plant.commands if plant else []
    return run, executor


def _tried(seed: int, folder: Path, counts: Counter[str]) -> None:
    result = compiled(specification(Random(f"{seed}")), folder)
    system = result.system
    if system is None or not only_about_machines(result):
        return
    script = Script(system, f"{seed}", marks_of(system))

    def plant(made: Built) -> Plant | None:
        return Plant(script, made.tick_s) if made.plant else None

    with built(system, None) as made:
        assert made.tests_all_rows
        expected = executed(made, plant(made), TICKS)
    with built(system, None) as made:
        found, executor = _in_real_time(made, plant(made), Random(seed), 0.0)
    assert not any(executor.skipped.values()), seed
    assert found.steps == expected.steps, seed
    assert found.commands == expected.commands, seed
    counts["as simulated"] += 1
    _stalled(system, plant, seed, counts)


def _stalled(system: System, plant: Any, seed: int, counts: Counter[str]) -> None:
    given: dict[str, list[Given]] = defaultdict(list)
    with built(system, None) as made:
        _noted(made, given)
        _, executor = _in_real_time(made, plant(made), Random(seed), 0.1)
    counts["skipped"] += sum(executor.skipped.values())
    for fault in executor.faults:
        counts[type(fault).__name__] += 1
        # A row that is not decided is told, whatever was proved of it.
        assert not isinstance(fault, UndecidedTransition) or len(fault.rows) != 1
    with built(system, None) as made, np.errstate(all="ignore"):
        for name, steps in given.items():
            machine: Any = made.scheduled(name).subsystem
            for skipped, x, left in steps:
                machine.skip(skipped)
                for slot in slots(machine.x):
                    if hasattr(x, slot):
                        setattr(machine.x, slot, getattr(x, slot))
                now = _left(machine, machine.step())
                assert same(now, left), (seed, name)
                counts["steps"] += 1


@pytest.mark.parametrize("seeds", blocks(range(2), long=4, each=25))
def test_random_systems(seeds: Seeds, tmp_path: Path) -> None:
    counts: Counter[str] = Counter()
    for seed in seeds:
        _tried(seed, tmp_path, counts)
    reached = counts["as simulated"] and counts["steps"] and counts["skipped"]
    assert reached or seeds.are_fresh
