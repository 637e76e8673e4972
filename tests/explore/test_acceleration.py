"""Repeated steps of random systems that count, against runs of them that take each step."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from random import Random

import pytest

from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from tests.explore.counters import counting
from tests.explore.test_societies import Followed, strayed
from tests.explore.verdicts import belied, misjudged
from tests.seeds import blocks

TICKS = 1200
BUDGET = 3000
PRECISIONS = (Precision(), Precision(exact=True), Precision(True, None))


def judged(seeds: Sequence[int], folder: Path) -> dict[str, int]:
    """How much was compared: complete graphs, edges of repeated steps, and what was said."""
    total = dict.fromkeys(("graphs", "repeated", "said"), 0)
    for seed in seeds:
        result = counting(Random(seed), folder)
        if not result.ok or result.system is None:
            continue
        run = Followed(result.system, 0)
        run.run(TICKS)
        abstraction = Abstraction(result.proofs)
        for names in abstraction.slices():
            for precision in PRECISIONS:
                graph = Graph(Composition(names, abstraction, precision), BUDGET)
                if graph.complete:
                    assert not (stray := strayed(graph, run.run_, run.fresh)), (seed, stray)
                    total["graphs"] += 1
                    total["repeated"] += sum(bool(e.loop) for out in graph.edges for e in out)
        there = explore(result.proofs, BUDGET)
        wrong, said = belied(result, there, range(1), TICKS)
        assert not wrong, (seed, wrong)
        assert misjudged(result, there, range(1), TICKS) == [], seed
        total["said"] += said + sum(each.verdict == "proved" for each in there.requirements)
    return total


@pytest.mark.parametrize("seeds", blocks(range(4), long=120, each=30))
def test_repeated_steps_are_what_runs_do(seeds: Sequence[int], tmp_path: Path) -> None:
    total = judged(seeds, tmp_path)
    assert all(total.values()), total
