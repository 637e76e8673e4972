"""What exploring says of random systems of many agents holds in every run of them."""

from __future__ import annotations

import re
from bisect import bisect
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import Any

import pytest

from specc.lang.evaluate import Environment, evaluate
from specc.model.system import System
from specc.pipeline import Result
from specc.proof import InputName
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Edge, Precision
from specc.tools.explore.explorer import explore
from specc.tools.explore.findings import findings
from specc.tools.explore.graph import Graph
from specc.tools.explore.partial import is_known
from specc.tools.explore.regions import Region
from specc.tools.explore.values import ValueTable
from specc.tools.explore.walker import Walker
from tests.explore.societies import society
from tests.explore.verdicts import belied, misjudged
from tests.seeds import Seeds, blocks
from tests.soundness.evaluator import Key, Value
from tests.soundness.interpreter import Interpreter, Run, Step
from tests.soundness.law import marks_of
from tests.soundness.operators import PLAIN
from tests.soundness.running import Script

TICKS = 120
BUDGET = 10_000
COPY = re.compile(r"workers_\d")


class Followed(Interpreter):
    """A run that remembers what was new to whom."""

    def __init__(self, system: System, seed: int) -> None:
        script = Script(system, str(seed), marks_of(system))
        super().__init__(system, PLAIN, script.measure)
        self.fresh: dict[str, list[frozenset[Key]]] = {name: [] for name in self.machines}

    def snapshot(self, name: str, tick: int) -> tuple[dict[Key, Value], frozenset[Key]]:
        inputs, fresh = super().snapshot(name, tick)
        self.fresh[name].append(fresh)
        return inputs, fresh


def strayed(graph: Graph, run: Run, fresh: dict[str, list[frozenset[Key]]]) -> str:
    """Where a run is no way of the graph, with what is known of values; nothing if it is one."""
    composition = graph.composition
    here = {0}
    for tick in range(1, 10**6):
        due = composition.due[tick % composition.hyperperiod]
        stamps = {i: tick // composition.ticks[i] for i in due}
        names = {i: composition.names[i] for i in due}
        if any(len(run.steps[names[i]]) <= stamps[i] for i in due):
            return ""
        if not due:
            continue
        steps = {i: run.steps[names[i]][stamps[i]] for i in due}
        new = {i: fresh[names[i]][stamps[i]] for i in due}
        there = {
            edge.target
            for number in here
            for edge in graph.edges[number]
            if _is(edge, steps, new, graph)
        }
        if not there:
            return f"{composition.names} at tick {tick}: {steps}"
        here = there
    raise AssertionError("the run does not end")


def _is(edge: Edge, steps: dict[int, Step], fresh: dict[int, frozenset[Key]], graph: Graph) -> bool:
    composition = graph.composition
    for i, move in edge.transitions:
        walker, step = composition.walkers[i], steps[i]
        if (move.target, move.row) != (step.state, step.transition):
            return False
        looked = (
            walker.input_use.read_by_conditions[move.source]
            | walker.input_use.read_by_functions[move.target]
        )
        ignored = set(walker.subsystem.state(move.source).ignores)
        lost = {k for k in walker.events & fresh[i] if k not in looked and k not in ignored}
        if lost != walker.events & set(dict(move.lost)):
            return False
        parts = composition.parts_of(graph.configurations[edge.target])
        memory = walker.states.by_number[parts[i].state].memory
        slots = walker.memory_slots.items()
        kept = [
            (_counted(walker, name, dict(step.memory)[name]), memory[slot]) for name, slot in slots
        ]
        kept += [(dict(step.sent)[f"{p}_{e}"], number) for (p, e), number in parts[i].pending]
        if not all(_fits(value, number, composition.values) for value, number in kept):
            return False
    return True


def _counted(walker: Walker, memory: str, value: Value) -> Value:
    """A value, or the number that stands for that many periods of a mode."""
    timer = walker.mode_timers.get(memory)
    if timer is None:
        return value
    if timer.counts:
        return min(value, timer.turns[-1])
    return timer.turns[bisect(timer.turns, value) - 1]


def _fits(value: Value, number: int, values: ValueTable) -> bool:
    """Whether a value is what is known of it."""
    known = values.value(number)
    if isinstance(known, Region):
        return bool(known.low <= value <= known.high)
    return not is_known(known) or evaluate(known, Environment()) == value


def overtaken(run: Followed, reader: str, key: InputName) -> Iterator[int]:
    """The base ticks at which a value replaced one that its reader had not seen."""
    ticks = run.ticks(reader)
    seen = sorted(s.visible for s in run.sent if (s.to, s.key) == (reader, key))
    for one, other in pairwise(seen):
        if (one + ticks - 1) // ticks == (other + ticks - 1) // ticks:
            yield other


def described(graph: Graph, abstraction: Abstraction, system: System) -> set[str]:
    found = findings(graph, abstraction, system).values()
    return {COPY.sub("workers", f"{f.code} {f.message} {f.trace.time_s}") for f in found}


def reached(graph: Graph) -> set[tuple[Any, ...]]:
    """States, whatever copy is in which."""
    composition = graph.composition
    places = [COPY.sub("workers", name) for name in composition.names]
    return {
        (c.phase, tuple(sorted(map("{} {}".format, places, composition.state_names(c)))))
        for c in graph.configurations
    }


def compare(result: Result, seed: int) -> dict[str, int]:
    """Explores a system in all ways, and runs it; says how much was compared."""
    system = result.system
    assert system is not None
    abstraction = Abstraction(result.proofs)
    runs = []
    for number in range(3):
        runs.append(Followed(system, number))
        runs[-1].run(TICKS)
    told = {"slices": 0, "copies": 0, "events": 0}
    for names in abstraction.slices():
        for exact in (False, True):
            graph = Graph(
                Composition(names, abstraction, Precision(exact), symmetric=False), BUDGET
            )
            if not graph.is_complete:
                continue
            told["slices"] += 1
            for run in runs:
                assert not (stray := strayed(graph, run.run_, run.fresh)), (seed, exact, stray)
            lost = {(i, key) for out in graph.edges for edge in out for i, key in edge.overwritten}
            for i, walker in enumerate(graph.composition.walkers):
                for key in walker.events & walker.slots.keys():
                    told["events"] += 1
                    late = [t for run in runs for t in overtaken(run, names[i], key)]
                    assert not late or (i, key) in lost, (seed, names[i], key, late)
            folded = Graph(Composition(names, abstraction, Precision(exact)), BUDGET)
            if folded.composition.copies:
                told["copies"] += 1
                assert folded.is_complete
                assert reached(folded) == reached(graph), seed
                one, all_ = (described(g, abstraction, system) for g in (folded, graph))
                assert one == all_, seed
    return told


def judge(seeds: Sequence[int], folder: Path, *, with_modes: bool = False) -> dict[str, int]:
    total = dict.fromkeys(("slices", "copies", "events", "said"), 0)
    for seed in seeds:
        result = society(Random(seed), folder, with_modes=with_modes)
        if result.ok:
            told = compare(result, seed)
            there = explore(result.proofs, BUDGET)
            found, said = belied(result, there, range(2), TICKS)
            assert not found, (seed, found)
            assert misjudged(result, there, range(2), TICKS) == [], seed
            said += sum(each.verdict == "proved" for each in there.requirements)
            total = {name: n + (told | {"said": said})[name] for name, n in total.items()}
    return total


@pytest.mark.parametrize("seeds", blocks([15], also=(0, 1, 2, 15), long=6, each=30))
def test_what_is_said_of_societies_holds(seeds: Seeds, tmp_path: Path) -> None:
    total = judge(seeds, tmp_path)
    assert all(total.values()) or seeds.are_fresh, total


@pytest.mark.parametrize("seeds", blocks([24], also=range(24), long=6, each=30))
def test_what_is_said_of_societies_with_modes_holds(seeds: Seeds, tmp_path: Path) -> None:
    total = judge(seeds, tmp_path, with_modes=True)
    assert all(total.values()) or seeds.are_fresh, total


@pytest.mark.parametrize("seeds", [range(4, 7), pytest.param(range(8), marks=pytest.mark.long)])
@pytest.mark.long
def test_an_explorer_that_never_loses_anything_is_noticed(
    seeds: range, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Walker, "_lost_inputs", lambda *_: ())
    with pytest.raises(AssertionError):
        judge(seeds, tmp_path)
