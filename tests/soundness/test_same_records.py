"""Generated code under the executor does, step for step, what the interpreter of the tests does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from random import Random
from typing import Any

import pytest

from specc.pipeline import compile_spec
from tests.seeds import Seeds, blocks
from tests.soundness import operators
from tests.soundness.agreement import differences
from tests.soundness.interpreter import Interpreter, Run
from tests.soundness.law import Verdict, compare
from tests.soundness.operators import PLAIN
from tests.soundness.running import built, executed
from tests.soundness.specifications import Tree, specification, text_of
from tests.soundness.values import NASTY

TICKS = 40

TWO_RATES = """\
specc: 1
system: two_rates
agents:
  slow:
    control:
      rate: 10 Hz
      y: {fast: {n: int}}
      memory: {k: {type: int, init: 5}}
      functions: {tell: {k: k + 1, y.fast.n: k}, count: {k: 2 * k}}
      behaviours:
        tell: {functions: [tell], terminal: always}
        rest: {functions: [count], terminal: always}
      states: {S0: tell, S1: rest}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
  fast:
    control:
      rate: 20 Hz
      x: {slow: {n: int}}
      y: {slow: {last: int}}
      conditions:
        initial:
          low: fresh(x.slow.n) and x.slow.n < 10
          other: not (fresh(x.slow.n) and x.slow.n < 10)
        terminal: {came: "fresh(x.slow.n) or elapsed > 0.1[s]"}
        error: {high: "present(x.slow.n) and x.slow.n > 20"}
      memory: {last: {type: int, init: 0}, since: {type: "real[s]", init: "1[s]"}}
      functions:
        keep: {last: "x.slow.n if present(x.slow.n) else -1", y.slow.last: last, since: elapsed}
      behaviours: {wait: {functions: [keep], terminal: came, error: high}}
      states: {A: wait, B: wait}
      initial_state: A
      transitions:
        - [A, terminal, low, B]
        - [A, terminal, other, A]
        - [A, error, always, A]
        - [B, terminal, low, A]
        - [B, terminal, other, B]
        - [B, error, always, B]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("soundness")


def runs_of(text: str, folder: Path, ticks: int, *, ok: bool = True) -> tuple[Run, Run]:
    """The runs of a specification without devices, by the interpreter and by generated code."""
    (folder / "fixed.yaml").write_text(text, encoding="utf-8")
    result = compile_spec(str(folder / "fixed.yaml"))
    system = result.system
    assert result.ok is ok
    assert system is not None

    def nothing(name: str, tick: int) -> Any:
        raise AssertionError(name)

    with built(system, None) as made:
        return Interpreter(system, PLAIN, nothing).run(ticks), executed(made, None, ticks)


def test_two_rates_by_hand(folder: Path) -> None:
    text = TWO_RATES.replace(
        "y: {fast: {n: int}}", "x: {fast: {last: int}}\n      y: {fast: {n: int}}"
    )
    expected, found = runs_of(text, folder, 12)
    assert differences(expected, found) == []
    # k is 5; told and counted up to 6; doubled to 12; told 12 and 13; doubled to 26; told 26.
    slow = [(s.state, s.transition, s.sent, dict(s.memory)["k"]) for s in expected.steps["slow.c"]]
    assert slow == [
        ("S0", -1, (("fast_n", 5),), 6),
        ("S1", 0, (), 12),
        ("S0", 1, (("fast_n", 12),), 13),
        ("S1", 0, (), 26),
        ("S0", 1, (("fast_n", 26),), 27),
        ("S1", 0, (), 54),
    ]
    # A value told at 0, 0.2 and 0.4 s can be seen at 0.1, 0.3 and 0.5 s. In between, 0.1 s is not
    # more than 0.1 s; 26 is an error in every period from 0.5 s on.
    fast = [(s.state, s.transition, dict(s.memory)) for s in expected.steps["fast.c"]]
    assert [(state, row) for state, row, _ in fast] == [
        ("A", -1), ("A", -1), ("B", 0), ("B", -1), ("B", -1), ("B", 4), ("B", 4), ("B", -1),
        ("B", -1), ("B", 4), ("B", 5), ("B", 5),
    ]  # fmt: skip
    assert [memory["last"] for _, _, memory in fast] == [-1, -1, 5, 5, 5, 5, 12, 12, 12, 12, 26, 26]


NO_ITEM = """specc: 1
system: no_item
agents:
  one:
    control:
      rate: 10 Hz
      memory:
        k: {type: "list[real]", init: "[]"}
        first: {type: real, init: 0.0}
      behaviours: {read: {functions: [{first: "k[0]"}], terminal: never}}
      states: {S0: read}
      initial_state: S0
"""


def test_an_item_that_is_not_there_is_a_fault(folder: Path) -> None:
    expected, found = runs_of(NO_ITEM, folder, 3, ok=False)
    assert [failure.kind for failure in expected.failures] == ["StepFailed"]
    assert differences(expected, found) == []


FAILS_ON_ENTRY = """specc: 1
system: fails_on_entry
agents:
  one:
    control:
      rate: 10 Hz
      memory:
        held: {type: "list[real[m]]", init: "[]"}
        taken: {type: "real[m]", init: 0}
      behaviours:
        wait: {functions: [], terminal: always}
        take: {functions: [{taken: "argmin(v for v in held)"}], terminal: always}
      conditions:
        initial:
          far: all(v > 1[m] for v in held)
          some: "len(held) > 0 and argmin(v for v in held) > 0.5[m]"
      states: {S0: wait, S1: take}
      initial_state: S0
      transitions: [[S0, terminal, far, S1], [S1, terminal, some, S1]]
"""


def test_a_behaviour_fails_in_the_state_that_is_entered(folder: Path) -> None:
    expected, found = runs_of(FAILS_ON_ENTRY, folder, 3, ok=False)
    assert [(failure.kind, failure.state) for failure in expected.failures] == [
        ("StepFailed", "S1")
    ]
    assert differences(expected, found) == []


def judged(tree: Tree, folder: Path, seed: str, tolerance: float = 0.0) -> Verdict:
    """The verdict, which has to be a good one."""
    verdict = compare(tree, folder, seed, TICKS, odd=NASTY, tolerance=tolerance)
    assert not verdict.differences, text_of(tree)
    assert not verdict.unsound, text_of(tree)
    return verdict


@pytest.mark.parametrize("seeds", blocks(range(16, 18), also=range(18, 22), long=8, each=15))
def test_random_specifications(seeds: Sequence[int], folder: Path) -> None:
    # Products of poses may be added up in any order, and a machine may multiply them again.
    for seed in seeds:
        judged(specification(Random(seed)), folder, str(seed), tolerance=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("seeds", blocks(range(60, 75), long=6, each=15))
def test_operators_that_raise(seeds: Seeds, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in operators.RAISING:
        raises = operators.rarely_raising(name)
        monkeypatch.setattr(operators, name, raises)
        monkeypatch.setitem(PLAIN, name, raises)
    failed = 0
    for seed in seeds:
        with suppress(ValueError):  # of a constant or an initial value: there is no run
            verdict = judged(specification(Random(seed)), folder, str(seed), tolerance=1e-12)
            failed += verdict.faults["StepFailed"]
    assert failed or seeds.are_fresh


@pytest.mark.long
def test_many_specifications_are_accepted_and_many_are_not(folder: Path) -> None:
    counts: Counter[str] = Counter()
    for seed in range(16):
        verdict = judged(specification(Random(seed)), folder, str(seed))
        counts.update(verdict.faults)
        counts["accepted"] += verdict.accepted
        counts["rejected, run all the same"] += verdict.usable and not verdict.accepted
        counts["steps"] += verdict.steps
    assert counts["accepted"] >= 6
    assert counts["rejected, run all the same"] >= 1
    assert counts["AxiomViolated"] >= 1
    assert counts["steps"] >= 800
