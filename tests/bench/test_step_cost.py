"""The benchmark of steps: generated and hand-written subsystems do the same."""

from __future__ import annotations

import copy
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench import contract_cost, step_cost
from bench.handwritten import irp_c
from bench.harness import building
from bench.harness.lockstep import Different, check_same, same
from bench.harness.rivals import copied
from bench.harness.stubs import random_inputs, stubbed


@pytest.fixture(scope="module")
def flagship(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package of the flagship."""
    return building.generate(building.FLAGSHIP, tmp_path_factory.mktemp("generated"))


@pytest.mark.long
def test_the_benchmark_of_contracts_runs_the_flagship(flagship: Path) -> None:
    run_s, samples_s, steps = contract_cost._run(flagship, 0.02)
    assert run_s > samples_s > 0.0
    assert steps["irp.m"] == 10


@pytest.mark.long
def test_tables_of_a_short_run(flagship: Path) -> None:
    text = step_cost.with_operators(flagship, duration_s=0.3, budget_s=0.0)
    assert [line.split()[0] for line in text.splitlines()[3:]] == [
        "irp.c",
        "irp.g",
        "irp.k",
        "irp.m",
    ]


@pytest.mark.long
def test_random_inputs_reach_every_state_of_the_flagship(flagship: Path) -> None:
    text = step_cost.without_operators(flagship, steps=3000, budget_s=0.0)
    states = {line.split()[0]: int(line.split()[1]) for line in text.splitlines()[3:]}
    assert states == {"irp.c": 9, "irp.g": 2, "irp.k": 2, "irp.m": 3}


@pytest.mark.long
def test_tables_of_small_machines(tmp_path: Path) -> None:
    package = building.generate(step_cost.TWO_MACHINES, tmp_path)
    text = step_cost.small_machines(package, steps=400, budget_s=0.0)
    assert text.count("  generated  ") == 4


def test_tables_of_growing_machines(tmp_path: Path) -> None:
    text = step_cost.growth(tmp_path, sizes=[3, 7], steps=50, budget_s=0.0)
    assert [line.split()[0] for line in text.splitlines()[3:]] == ["3", "7"]


class Wrong(irp_c.Picking):
    """Forgets to open the gripper in S5."""

    def _open_gripper(self) -> None:
        self.y.g_d_d = 0.0


def test_a_difference_is_found(flagship: Path) -> None:
    files = {"irp6": "", "objects": ""}
    kind = type(building.fresh(flagship, building.FLAGSHIP.parent, "irp.c"))
    with stubbed(building.module_of(kind), irp_c):
        generated = building.fresh(flagship, building.FLAGSHIP.parent, "irp.c")
        inputs = random_inputs(type(generated.x), 500, random.Random(0))
        pairs = [(copied(irp_c.Inputs, x), x) for x in inputs]
        with pytest.raises(Different, match=r"'S5' and 'S5': y\.g_d_d"):
            check_same(Wrong(files), generated, pairs, generated.sends)


@pytest.mark.parametrize(
    ("value", "other"),
    [
        (np.array([1.0, np.nan]), np.array([1.0, 2.0])),
        ((1.0, "a"), (1.0, "b")),
        ((1.0,), (1.0, 2.0)),
        (1, 1.0),
        ({"a": 1}, {"a": 2}),
    ],
)
def test_values_are_the_same_or_not(value: Any, other: Any) -> None:
    assert same(value, copy.deepcopy(value))
    assert not same(value, other)
