"""Whatever states a system comes to together, they are among those that exploring it finds."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from specc.model.system import System
from specc.pipeline import Result, compile_spec
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from tests.soundness.interpreter import Interpreter, Run
from tests.soundness.law import marks_of
from tests.soundness.operators import PLAIN
from tests.soundness.running import Script, compiled
from tests.soundness.specifications import specification
from tests.soundness.values import NASTY

ROOT = Path(__file__).parents[2]
TICKS = 60
BUDGET = 6_000

Reached = set[tuple[int, tuple[str, ...]]]
"""Phases of the hyperperiod with the states of the machines after them."""


def explored(composition: Composition, budget: int = BUDGET) -> tuple[Reached, bool]:
    """What is found, and whether it is all there is."""
    graph = Graph(composition, budget)
    return {(c.phase, composition.states(c)) for c in graph.configurations}, graph.complete


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


def interpreted(system: System, seed: str) -> Run:
    script = Script(system, seed, marks_of(system), NASTY)
    return Interpreter(system, PLAIN, script.measure).run(TICKS)


def missed(result: Result, seeds: range) -> tuple[list[str], int]:
    """What runs reach and exploring does not, and how many slices were compared."""
    assert result.system is not None
    found, compared = [], 0
    abstraction = Abstraction(result.proofs)
    runs = [interpreted(result.system, str(seed)) for seed in seeds]
    for names in abstraction.slices():
        for exact in (False, True):
            composition = Composition(names, abstraction, exact=exact)
            there, complete = explored(composition)
            if complete:
                compared += 1
                for run in runs:
                    beyond = run_through(composition, run) - there
                    found += [f"{names} {exact} {each}" for each in beyond]
    return found, compared


def test_random_systems(tmp_path: Path) -> None:
    total = 0
    for seed in range(12):
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok:
            found, compared = missed(result, range(3))
            assert not found, seed
            total += compared
    assert total >= 6


@pytest.mark.long
def test_more_random_systems(tmp_path: Path) -> None:
    total = 0
    for seed in range(1000, 1120):
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok:
            found, compared = missed(result, range(3))
            assert not found, seed
            total += compared
    assert total >= 30


def test_an_explorer_that_delivers_nothing_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The conveyor's belt never leaves its first state then."""
    result = compile_spec(str(ROOT / "specs/conveyor_gate.yaml"))
    assert not missed(result, range(2))[0]
    monkeypatch.setattr(Composition, "_deliver", lambda self, due, parts: ())
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


def belied(result: Result, seeds: range) -> tuple[list[str], int]:
    """What exploring says of all runs and a run belies, and how many such things it said."""
    assert result.system is not None
    found, said = [], 0
    there = explore(result.proofs, BUDGET)
    runs = [interpreted(result.system, str(seed)) for seed in seeds]
    for name, axiom, verdict in there.assumptions:
        subsystem = next(s for s in result.system.subsystems if s.qualified_name == name)
        index = str(subsystem.axioms.index(axiom))
        for failure in (f for run in runs for f in run.failures):
            wrong = failure.subsystem == name and failure.kind == "AxiomViolated"
            if verdict == "proved" and wrong and index in failure.about:
                found.append(f"{name} {index}: {failure}")
        said += verdict == "proved"
    for finding in (f for f in there.findings if f.way.is_decided and f.code != "W1006"):
        said += 1
        for run in runs:
            ran = {name: iter(steps) for name, steps in run.steps.items()}
            for step in finding.way.steps:
                took = next(ran[step.walker.name], None)
                if took and (took.state, took.transition) != (step.move.target, step.move.row):
                    found.append(f"{finding.message}: {step.words()}, but {took}")
            if finding.code in ("W1001", "W1003", "W1004") and finding.about[-1] != "task":
                _, name, state = finding.about
                found += [f"{finding.message}: {s}" for s in ran[str(name)] if s.state != state]
    return found, said


def test_what_is_said_of_random_systems_holds(tmp_path: Path) -> None:
    total = 0
    for seed in range(1000, 1060):
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok:
            found, said = belied(result, range(2))
            assert not found, seed
            total += said
        if total >= 2:
            return
    raise AssertionError("too little is said")


@pytest.mark.long
def test_what_is_said_of_more_random_systems_holds(tmp_path: Path) -> None:
    total = 0
    for seed in range(1000, 1100):
        result = compiled(specification(Random(seed)), tmp_path)
        if result.ok:
            found, said = belied(result, range(3))
            assert not found, seed
            total += said
    assert total >= 3
