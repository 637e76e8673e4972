"""Whatever states a system comes to together, they are among those that exploring it finds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from random import Random

import pytest

from specc.pipeline import Result, compile_spec
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from tests.explore.verdicts import belied, interpreted
from tests.seeds import Seeds, blocks
from tests.soundness.interpreter import Run
from tests.soundness.running import compiled
from tests.soundness.specifications import specification

ROOT = Path(__file__).parents[2]
TICKS = 60
BUDGET = 6_000

Reached = set[tuple[int, tuple[str, ...]]]
"""Phases of the hyperperiod with the states of the machines after them."""


def explored(composition: Composition, budget: int = BUDGET) -> tuple[Reached, bool]:
    """What is found, and whether it is all there is."""
    graph = Graph(composition, budget)
    return {(c.phase, composition.state_names(c)) for c in graph.configurations}, graph.is_complete


def run_through(composition: Composition, run: Run) -> Reached:
    """The same of a run, at the base ticks at which a machine of the composition is due."""
    found: Reached = set()
    ticks = composition.ticks
    for tick in range(10**6):
        phase = tick % composition.hyperperiod
        if not composition.due[phase]:
            continue
        stamps = [tick // every for every in ticks]
        steps = [run.steps[name] for name in composition.names]
        if any(len(each) <= stamp for each, stamp in zip(steps, stamps, strict=True)):
            return found
        found.add((phase, tuple(e[s].state for e, s in zip(steps, stamps, strict=True))))
    raise AssertionError("the run does not end")


def missed(result: Result, seeds: range) -> tuple[list[str], int]:
    """What runs reach and exploring does not, and how many slices were compared."""
    assert result.system is not None
    found, compared = [], 0
    abstraction = Abstraction(result.proofs)
    runs = [interpreted(result.system, seed, TICKS) for seed in seeds]
    for names in abstraction.slices():
        for exact in (False, True):
            composition = Composition(names, abstraction, Precision(exact))
            there, complete = explored(composition)
            if complete:
                compared += 1
                for run in runs:
                    beyond = run_through(composition, run) - there
                    found += [f"{names} {exact} {each}" for each in beyond]
    return found, compared


@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 7), long=8, each=30))
def test_random_systems(seeds: Seeds, tmp_path: Path) -> None:
    total = 0
    for seed in seeds:
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok:
            found, compared = missed(result, range(3))
            assert not found, seed
            total += compared
    assert total or seeds.are_fresh


def test_an_explorer_that_delivers_nothing_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The conveyor's belt never leaves its first state then."""
    result = compile_spec(str(ROOT / "specs/conveyor_gate.yaml"))
    assert not missed(result, range(2))[0]
    monkeypatch.setattr(Composition, "deliver", lambda self, due, numbers: ())
    assert missed(result, range(2))[0]


@pytest.mark.parametrize(
    "spec", ["conveyor_gate.yaml", "skeletons/joint/joint.yaml", "skeletons/two-agents/told.yaml"]
)
def test_written_systems(spec: str) -> None:
    result = compile_spec(str(ROOT / "specs" / spec))
    assert result.system is not None
    found, compared = missed(result, range(2))
    assert not found
    assert compared >= 1


@pytest.mark.long
def test_what_is_said_of_random_systems_holds(tmp_path: Path) -> None:
    total = 0
    for seed in range(1000, 1060):
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok:
            there = explore(result.proofs, BUDGET)
            found, said = belied(result, there, range(2), TICKS)
            assert not found, seed
            total += said
        if total >= 2:
            return
    raise AssertionError("too little is said")


@pytest.mark.parametrize("seeds", blocks((), long=8, each=30)[1:])
def test_what_is_said_of_more_random_systems_holds(seeds: Sequence[int], tmp_path: Path) -> None:
    for seed in seeds:
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok:
            found, _ = belied(result, explore(result.proofs, BUDGET), range(3), TICKS)
            assert not found, seed
