"""What is known to be fresh is so in every period of a run but the first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.system import System as Built

from specc.analysis import Facts
from specc.model.system import System
from specc.proof import InputName
from tests.seeds import Seeds, blocks
from tests.soundness.law import marks_of
from tests.soundness.running import (
    Script,
    ScriptedPlant,
    built,
    compiled,
    executed,
    only_about_machines,
)
from tests.soundness.specifications import specification

TICKS = 60


def watched(system: Built, known: dict[str, frozenset[InputName]], late: list[str]) -> int:
    """Has every step note what ought to be fresh and is not; how many inputs are asked about."""
    asked = 0
    for scheduled in system.subsystems:
        machine = scheduled.subsystem
        flags = [f"fresh_{peer}_{name}" for peer, name in sorted(known[machine.name])]
        flags = [flag for flag in flags if hasattr(machine.x, flag)]
        asked += len(flags)
        kind = type(machine)
        kind.step = _noting(kind.step, flags, late)  # type: ignore[method-assign]  # a class of one run
    return asked


def _noting(step: Callable[..., Any], flags: list[str], late: list[str]) -> Callable[..., Any]:
    periods = 0

    def noting(machine: Any) -> Any:
        nonlocal periods
        if periods:
            late.extend(f"{machine.name} {f}" for f in flags if not getattr(machine.x, f))
        periods += 1
        return step(machine)

    return noting


def known_of(system: System) -> dict[str, frozenset[InputName]]:
    facts = Facts(system)
    return {m.subsystem.qualified_name: m.availability.fresh for m in facts.machines}


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 5), long=10, each=20))
def test_in_random_systems(seeds: Seeds, tmp_path: Path) -> None:
    asked = 0
    for seed in seeds:
        result = compiled(specification(Random(seed)), tmp_path)
        if result.system is None or not only_about_machines(result):
            continue
        late: list[str] = []
        with built(result.system, None) as made:
            asked += watched(made, known_of(result.system), late)
            script = Script(result.system, str(seed), marks_of(result.system))
            executed(made, ScriptedPlant(script) if made.plant else None, TICKS)
        assert not late, seed
    assert asked or seeds.are_fresh
