"""What `specc explore` says of small systems, against all that their generated code can do."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.cycle import Executor

from specc.emit import fill_templates
from specc.lower import lower
from specc.pipeline import Result
from specc.tools.explore.composition import Composition
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from tests.explore.against_enumeration import disagreements
from tests.explore.enumeration import Enumeration
from tests.explore.formulas import Memory
from tests.explore.simulation import has_every_run, made_graphs, random_run, unlike_run
from tests.explore.small_systems import SmallSystem, small_system
from tests.seeds import Seeds, blocks
from tests.soundness.running import compiled, package

BUDGET = 20_000
BUDGETS = (3 * BUDGET, 3 * BUDGET, BUDGET, 2_000)
RUNS = 3
TICKS = 120


class RandomPlant:
    """A plant whose sensors report any of their values."""

    def __init__(self, rng: Random, domains: dict[str, tuple[object, ...]]) -> None:
        self.rng, self.domains = rng, domains

    def reset(self, seed: int) -> None:
        pass

    def sample(self, name: str) -> object:
        return self.rng.choice(self.domains[name])

    def actuate(self, name: str, value: object) -> None:
        pass

    def advance(self, duration_s: float) -> None:
        pass

    def close(self) -> None:
        pass


def unlike(system: SmallSystem, result: Result, there: Enumeration, rng: Random) -> list[str]:
    """Where a run of the executor, with its monitors, is none of those that were enumerated."""
    assert result.system is not None
    with package(fill_templates(lower(result.system, None))) as modules:
        made = modules["system.py"].build("")
        required = made.requirements
        assert required is not None
        required.follow(
            {s.subsystem.name: (s.subsystem, s.ticks) for s in made.subsystems}, made.tick_s
        )
        plant = RandomPlant(rng, system.domains) if made.plant else None
        executor = Executor(made, plant, [required], inline=True)
        judges = [formula.judge(made.tick_s) for formula in system.formulas]
        memory: list[Memory] = [None] * len(judges)
        failed = [False] * len(judges)
        before = [[*failed]]
        here = {edge.target for edge in there.first}
        for tick in range(TICKS):
            if tick:
                if any(number >= len(there.edges) for number in here):
                    break
                here = {edge.target for number in here for edge in there.edges[number]}
            assert executor.advance()
            required.advance(executor.tick)
            now = [
                (s.subsystem.state, tuple(getattr(s.subsystem.memory, n) for n in machine.memory))
                for s, machine in zip(made.subsystems, there.machines, strict=True)
            ]
            here = {n for n in here if _places(there, n) == now}
            if not here:
                return [f"tick {tick} is not enumerated: {now}"]
            for i, (formula, judge) in enumerate(zip(system.formulas, judges, strict=True)):
                truths = {formula.truths(there.view(number)) for number in here}
                memory[i], fails = judge(memory[i], *truths.pop())
                assert not truths, formula.text
                failed[i] |= fails
            before.append([*failed])
        required.finish(executor.tick)
        verdicts = [item["verdict"] for item in required.as_data()]
    # What machines make of their last period is unknown where a run ends.
    last = max(machine.ticks for machine in there.machines)
    known = before[max(0, len(before) - 1 - last)]
    return [
        f"{formula.text}: {verdict} in a run, {fails} as enumerated"
        for formula, verdict, fails, surely in zip(
            system.formulas, verdicts, failed, known, strict=True
        )
        if (verdict == "violated") not in (fails, surely)
    ]


def _places(there: Enumeration, number: int) -> list[tuple[str, tuple[object, ...]]]:
    parts = [part.local for part in there.configurations[number].parts]
    return [(state, memory) for state, _, memory in parts]


@pytest.mark.parametrize("seeds", blocks(range(1), also=range(1, 4), long=10, each=5))
def test_runs_are_among_those_that_are_enumerated(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        system = small_system(Random(seed))
        result = compiled(system.tree, tmp_path)
        assert result.ok, seed
        there = system.enumerated(result)
        for run in range(3):
            assert not unlike(system, result, there, Random(run)), seed


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 6), long=20, each=5))
def test_what_is_said_of_small_systems_is_what_they_do(seeds: Seeds, tmp_path: Path) -> None:
    counts = Counter[str]()
    for seed in seeds:
        system = small_system(Random(seed))
        result = compiled(system.tree, tmp_path)
        assert result.ok, seed
        with made_graphs() as graphs:
            said = explore(result.proofs, BUDGETS[seed % len(BUDGETS)])
        there = system.enumerated(result)
        assert not [*disagreements(said, there, system.formulas, counts)], seed
        assert not left(there, graphs, counts), seed
    assert seeds.are_fresh or {"proved", "violated", "can fail", "graphs"} <= counts.keys()


def left(there: Enumeration, graphs: list[Graph], counts: Counter[str]) -> list[str]:
    """Where random runs leave complete graphs."""
    runs = [random_run(there, Random(number), TICKS) for number in range(RUNS)]
    whole = [graph for graph in graphs if has_every_run(graph)]
    counts["graphs"] += len(whole)
    found = (unlike_run(graph, run, there.system.tick_s) for graph in whole for run in runs)
    return [*filter(None, found)]


@pytest.mark.long
def test_an_explorer_that_delivers_nothing_is_noticed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(Composition, "deliver", lambda self, due, numbers: ())
    system = small_system(Random(3))
    result = compiled(system.tree, tmp_path)
    with made_graphs() as graphs:
        explore(result.proofs, BUDGET)
    assert left(system.enumerated(result), graphs, Counter())


DOUBTS = ("not explored", "may be violated", "open", "not decided")
"""What more steps may decide either way."""


@pytest.mark.parametrize("seeds", blocks((), also=range(4), long=8, each=4)[1:])
def test_more_steps_decide_nothing_the_other_way(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        result = compiled(small_system(Random(seed)).tree, tmp_path)
        said = [explore(result.proofs, budget).requirements for budget in (500, 5_000, 50_000)]
        for verdicts in zip(*said, strict=True):
            sure = {each.verdict for each in verdicts} - {*DOUBTS}
            assert len(sure) < 2, (seed, verdicts[0].requirement.that)
            proved = [each.verdict == "proved" for each in verdicts]
            later = [e.verdict for e in verdicts[proved.index(True) :]] if any(proved) else []
            assert "may be violated" not in later, (seed, verdicts[0].requirement.that)


@pytest.mark.parametrize("seeds", blocks((), also=range(2), long=4, each=2)[1:])
def test_a_requirement_has_the_same_verdict_alone(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        system = small_system(Random(seed))
        together = explore(compiled(system.tree, tmp_path).proofs, BUDGET)
        for number, each in enumerate(together.requirements):
            alone = explore(compiled(system.alone(number), tmp_path).proofs, BUDGET)
            assert [r.verdict for r in alone.requirements] == [each.verdict], (seed, number)


WRONG = {
    "proved": ("violated", "may be violated", "open"),
    "violated": ("proved", "may be violated", "open"),
}


@pytest.mark.long
@pytest.mark.parametrize("verdict", WRONG)
def test_a_wrong_verdict_is_noticed(verdict: Any, tmp_path: Path) -> None:
    """Each requirement gets it that has another one; in most systems one of them belies it."""
    noticed = compared = 0
    for seed in range(6):
        system = small_system(Random(seed))
        result = compiled(system.tree, tmp_path)
        said, there = explore(result.proofs, BUDGET), system.enumerated(result)
        for number, each in enumerate(said.requirements):
            if each.verdict in WRONG[verdict]:
                compared += 1
                wrong = replace(said)
                wrong.requirements = list(said.requirements)
                wrong.requirements[number] = replace(each, verdict=verdict)
                noticed += bool([*disagreements(wrong, there, system.formulas, Counter())])
    assert 2 * noticed >= compared > 2


def test_silence_is_noticed(tmp_path: Path) -> None:
    """Of an exploration that finds nothing, where an event is lost and a machine waits for ever."""
    system = small_system(Random(4))
    result = compiled(system.tree, tmp_path)
    said, there = explore(result.proofs, BUDGET), system.enumerated(result)
    found = [*disagreements(replace(said, findings=[]), there, system.formulas, Counter())]
    assert any("is lost" in each for each in found)
    assert any("never leaves" in each for each in found)
