"""Random machines with modes: what is accepted, and what is generated, against the interpreter."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from tests.seeds import Seeds, blocks
from tests.soundness.modes.laws import Findings, accepted_decides, same_steps
from tests.soundness.modes.random_machines import specification


@pytest.mark.parametrize("seeds", blocks(range(8), long=0, each=1))
def test_machines_without_modes_are_machines_with_modes(seeds: Seeds, tmp_path: Path) -> None:
    found = Findings()
    for seed in seeds:
        same_steps(specification(Random(seed), modes=False), tmp_path, f"{seed}", found)
    assert found.wrong == []
    assert found.counts["accepted"] > 2 < found.counts["refused"]


@pytest.mark.parametrize("seeds", blocks(range(12), also=range(12, 60), long=60, each=30))
def test_generated_code_does_what_the_interpreter_does(seeds: Seeds, tmp_path: Path) -> None:
    found = Findings()
    for seed in seeds:
        same_steps(specification(Random(seed)), tmp_path, f"{seed}", found)
    assert found.wrong == []
    assert (found.counts["accepted"] and found.counts["refused"]) or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(12), also=range(12, 60), long=60, each=30))
def test_what_is_accepted_decides(seeds: Seeds, tmp_path: Path) -> None:
    found = Findings()
    for seed in seeds:
        accepted_decides(specification(Random(seed)), tmp_path, f"{seed}", found)
    assert found.wrong == []
    assert (found.counts["accepted"] and found.counts["seen to fail"]) or seeds.are_fresh
