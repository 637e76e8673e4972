"""Repeated steps of systems that count, against runs of them that take each step."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from random import Random
from typing import Any

import pytest

from specc.model import expr as m
from specc.model.types import Int, Real
from specc.pipeline import Result
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.acceleration import Loop
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from specc.tools.explore.progressions import Progression, progression_of
from specc.tools.explore.timing import Clocks, ModeTimer
from specc.tools.explore.tracker import RequirementTracker
from tests.explore.counters import counting
from tests.explore.test_societies import Followed, strayed
from tests.explore.verdicts import belied, misjudged
from tests.seeds import Seeds, blocks, every
from tests.soundness.running import compiled

TICKS = 1500
BUDGET = 2000
PRECISIONS = (Precision(), Precision(counts_time=True), Precision(True, None))


def wrong(result: Result, total: dict[str, int]) -> list[str]:
    """What a run belies; counts complete graphs, edges of repeated steps, and what was said."""
    assert result.system is not None
    run = Followed(result.system, 0)
    run.run(TICKS)
    found = []
    abstraction = Abstraction(result.proofs)
    for names in abstraction.slices():
        for precision in PRECISIONS:
            graph = Graph(Composition(names, abstraction, precision), BUDGET)
            if graph.is_complete:
                found.append(strayed(graph, run.run_, run.fresh))
                total["graphs"] += 1
                total["repeated"] += sum(bool(e.loop) for out in graph.edges for e in out)
    there = explore(result.proofs, BUDGET)
    lies, said = belied(result, there, range(1), TICKS)
    total["said"] += said + sum(each.verdict == "proved" for each in there.requirements)
    return [*filter(None, found), *lies, *misjudged(result, there, range(1), TICKS)]


def judged(seeds: Sequence[int], folder: Path, *, with_modes: bool = False) -> dict[str, int]:
    """How much was compared, of random systems."""
    total = dict.fromkeys(("graphs", "repeated", "said"), 0)
    for seed in seeds:
        result = counting(Random(seed), folder, with_modes=with_modes)
        if result.ok:
            assert (wrong(result, total), seed) == ([], seed)
    return total


@pytest.mark.parametrize("seeds", blocks((0, 4), long=2, each=30))
def test_repeated_steps_are_what_runs_do(seeds: Seeds, tmp_path: Path) -> None:
    total = judged(seeds, tmp_path)
    assert all(total[name] for name in ("graphs", "said", "repeated")) or seeds.are_fresh, total


@pytest.mark.parametrize("seeds", blocks((2, 16), also=range(1, 26), long=2, each=30))
def test_repeated_steps_with_modes_are_what_runs_do(seeds: Seeds, tmp_path: Path) -> None:
    total = judged(seeds, tmp_path, with_modes=True)
    assert all(total[name] for name in ("graphs", "said", "repeated")) or seeds.are_fresh, total


def alone(end: str, step: dict[str, str], require: str = "a.c.k >= 0") -> dict[str, Any]:
    """A machine that counts `k` and `r` until something turns."""
    control = {
        "rate": "10 Hz",
        "y": {"b": {"done": "bool"}},
        "memory": {
            "k": {"type": "int", "init": 0},
            "j": {"type": "int", "init": 0},
            "r": {"type": "real", "init": "4503599627370196.0"},
        },
        "conditions": {"terminal": {"end": end}},
        "functions": {"count": {"k": "k + 1"} | step, "tell": {"y.b.done": "True"}},
        "behaviours": {
            "count": {"functions": ["count"], "terminal": "end"},
            "tell": {"functions": ["tell"], "terminal": "never"},
        },
        "states": {"S0": "count", "S1": "tell"},
        "initial_state": "S0",
        "transitions": [["S0", "terminal", "always", "S1"]],
    }
    reader = {
        "rate": "10 Hz",
        "x": {"a": {"done": {"type": "bool", "init": "False"}}},
        "conditions": {"terminal": {"done": "x.a.done"}},
        "functions": {},
        "behaviours": {"wait": {"functions": [], "terminal": "done"}},
        "states": {"S0": "wait"},
        "initial_state": "S0",
        "transitions": [["S0", "terminal", "always", "S0"]],
    }
    return {
        "specc": 1.1,
        "system": "alone",
        "agents": {"a": {"control": control}, "b": {"control": reader}},
        "require": [{"that": f"always({require})", "because": "it is so"}],
    }


@pytest.mark.parametrize("end", every(2, ["k >= 400", "k >= 401"]))
def test_zeros_that_change_their_sign_are_not_the_same(end: str, tmp_path: Path) -> None:
    step = {"r": "-r if abs(r) < 1 else 0.0"}
    result = compiled(alone(f"{end} and atan2(r, -1) > 0[rad]", step), tmp_path)
    assert wrong(result, dict.fromkeys(("graphs", "repeated", "said"), 0)) == []


def test_a_line_has_no_zero_with_a_sign() -> None:
    step = Progression(Fraction(-2), Fraction(1))
    real, whole = (m.MemoryRef("r", type=of) for of in (Real(), Int()))
    turned = m.Unary("-", real, type=Real())
    assert progression_of(turned, {real: step}.get, 2) == Progression(Fraction(2), Fraction(-1))
    assert progression_of(turned, {real: step}.get, 3) is None
    assert progression_of(m.Unary("-", whole, type=Int()), {whole: step}.get, 3) is not None
    assert progression_of(m.Binary("+", real, real, type=Real()), {real: step}.get, 3) is not None
    for factor, times, is_line in (
        (0.5, 9, True),
        (-0.5, 2, True),
        (-0.5, 3, False),
        (0.0, 1, False),
        (-0.0, 1, False),
    ):
        product = m.Binary("*", real, m.Number(factor, type=Real()), type=Real())
        assert (progression_of(product, {real: step}.get, times) is not None) == is_line, factor
    rising = Progression(Fraction(0), Fraction(1))
    product = m.Binary("*", real, m.Number(0.0, type=Real()), type=Real())
    assert progression_of(product, {real: rising}.get, 9) == Progression(Fraction(0), Fraction(0))


@pytest.mark.parametrize(
    "z", every(3, ["s - k", "-0.0 - k", "s - n", "k * -0.0", "0.0 * k", "-1 * k"])
)
def test_what_is_minus_zero_on_the_way_is_not_skipped(z: str, tmp_path: Path) -> None:
    step = {"k": "k + 1", "n": "n + 1", "z": z}
    tree = alone("k >= 1 and atan2(z, -1) < -3[rad]", step, "state(a.c) == S0 or a.c.k > 1")
    memory = {"k": "int", "n": "int", "z": "real", "s": "real"}
    starts = {"k": "-100.0", "n": "-100", "z": "1.0", "s": "-0.0"}
    control = tree["agents"]["a"]["control"]
    control["memory"] = {n: {"type": of, "init": starts[n]} for n, of in memory.items()}
    control["memory"]["k"]["type"] = "real"
    result = compiled(tree, tmp_path)
    assert result.ok, result.diagnostics
    assert wrong(result, dict.fromkeys(("graphs", "repeated", "said"), 0)) == []


def timed() -> dict[str, Any]:
    """A machine that counts on when the time of its mode does not matter any more."""
    tree = alone("k >= 400", {})
    control = tree["agents"]["a"]["control"]
    late = {"late": "elapsed(m) > 10[s] and k < 5"}
    control["modes"] = {"m": {"states": ["S0"], "error": late}}
    control["transitions"].append(["m", "late", "always", "S1"])
    return tree


CARELESS = {
    "time of modes": (ModeTimer, "is_counted_over", lambda *_: True, timed()),
    "time": (Clocks, "is_constant", lambda *_: True, alone("elapsed > 20[s] or k >= 400", {})),
    "rounding": (
        Progression,
        "is_exact",
        lambda *_: True,
        alone("r >= 4503599627370505.0", {"r": "r + 0.5"}),
    ),
    "steps": (Loop, "_holds_for", lambda _, n: n < 300, alone("k + 200 < j", {"j": "j + 2"})),
    "requirements": (
        RequirementTracker,
        "conditions",
        lambda *_: [],
        alone("k >= 400", {}, "a.c.k != 300"),
    ),
}
"""A question, an answer that is too good, and a system in which that is wrong."""


@pytest.mark.parametrize(
    ("where", "name", "answer", "tree"), every(2, [*CARELESS.values()]), ids=CARELESS
)
def test_an_acceleration_that_does_not_ask_is_noticed(
    where: Any, name: str, answer: Any, tree: Any, tmp_path: Path, monkeypatch: Any
) -> None:
    total = dict.fromkeys(("graphs", "repeated", "said"), 0)
    result = compiled(tree, tmp_path)
    assert result.ok, result.diagnostics
    assert wrong(result, total) == []
    assert total["repeated"] or name == "is_exact"
    monkeypatch.setattr(where, name, answer)
    assert wrong(result, total)
