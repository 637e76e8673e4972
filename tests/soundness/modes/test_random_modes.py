"""Random machines with modes: what is accepted, said and generated, against the interpreter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import pytest

from tests.seeds import Seeds, blocks
from tests.soundness.modes import laws, random_resumes
from tests.soundness.modes.laws import Findings
from tests.soundness.modes.random_machines import specification
from tests.soundness.modes.reached import RULES, rules_of
from tests.soundness.modes.scripted import Written, control_of, interpreted, script

Law = Callable[[Any, Path, str, Findings], None]


def held_against(law: Law, seeds: Seeds, folder: Path, *, modes: bool = True) -> Counter[str]:
    """What a law counts; nothing may be wrong."""
    found = Findings()
    for seed in seeds:
        law(specification(Random(seed), modes=modes), folder, f"{seed}", found)
        assert found.wrong == [], seed
    return found.counts


@pytest.mark.parametrize("seeds", blocks(range(6), long=0, each=1))
def test_machines_without_modes_are_machines_with_modes(seeds: Seeds, tmp_path: Path) -> None:
    counts = held_against(laws.same_steps, seeds, tmp_path, modes=False)
    assert counts["accepted"] > 1 < counts["refused"]


@pytest.mark.parametrize("seeds", blocks(range(4), also=range(4, 30), long=20, each=10))
def test_generated_code_does_what_the_interpreter_does(seeds: Seeds, tmp_path: Path) -> None:
    counts = held_against(laws.same_steps, seeds, tmp_path)
    assert (counts["accepted"] and counts["refused"]) or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(6), also=range(6, 30), long=20, each=10))
def test_what_is_accepted_decides(seeds: Seeds, tmp_path: Path) -> None:
    counts = held_against(laws.accepted_decides, seeds, tmp_path)
    assert (counts["accepted"] and counts["seen to fail"]) or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(14, 20), also=range(50), long=40, each=40))
def test_what_is_resumed_has_what_it_relies_on(seeds: Seeds, tmp_path: Path) -> None:
    found = Findings()
    for seed in seeds:
        tree = random_resumes.specification(Random(seed))
        laws.accepted_decides(tree, tmp_path, f"{seed}", found)
        laws.same_steps(tree, tmp_path, f"{seed}", found)
        assert found.wrong == [], seed
    assert (found.counts["accepted"] and found.counts["seen to fail"]) or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(6), also=range(6, 30), long=20, each=10))
def test_what_is_refused_is_undecided(seeds: Seeds, tmp_path: Path) -> None:
    counts = held_against(laws.refused_is_refuted, seeds, tmp_path)
    assert counts["refutations"] or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(4), also=range(4, 20), long=15, each=15))
def test_what_never_happens_never_happens(seeds: Seeds, tmp_path: Path) -> None:
    assert held_against(laws.never_is_never, seeds, tmp_path)["claims"] or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 10), long=6, each=6))
def test_exploring_finds_all_that_happens(seeds: Seeds, tmp_path: Path) -> None:
    counts = held_against(laws.explored_is_all, seeds, tmp_path)
    assert counts["complete or proved"] or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 8), long=4, each=4))
def test_traces_of_exploring_are_runs(seeds: Seeds, tmp_path: Path) -> None:
    assert held_against(laws.traces_are_runs, seeds, tmp_path)["traces"] or seeds.are_fresh


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 10), long=6, each=6))
def test_recordings_replay(seeds: Seeds, tmp_path: Path) -> None:
    assert held_against(laws.recordings_replay, seeds, tmp_path)["recordings"] or seeds.are_fresh


def test_random_machines_come_by_every_rule() -> None:
    counts = Counter[str]()
    for seed in range(60):
        tree = specification(Random(seed))
        steps = list(interpreted(tree, script(Random(f"{seed} 0.0"), 60)))
        counts.update(rules_of(Written(control_of(tree)), steps))
    assert set(counts) == set(RULES)
