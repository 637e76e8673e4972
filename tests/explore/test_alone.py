"""The verdict on a requirement is the same alone and beside others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from specc.analysis import Facts
from specc.pipeline import Result, compile_spec
from specc.tools.explore.explorer import explore
from tests.explore.counters import counting
from tests.explore.societies import society
from tests.seeds import blocks

BUDGET = 20_000


def said(result: Result) -> list[tuple[object, ...]]:
    """What is said of each requirement."""
    found = explore(result.proofs, BUDGET)
    messages = {f.identity: f.message for f in found.findings}
    return [
        (each.summary(), each.assumptions, each.finding and messages.get(each.finding.identity))
        for each in found.requirements
    ]


def alone(result: Result) -> list[tuple[object, ...]]:
    """The same, of systems that have one of the requirements each."""
    assert result.system is not None
    found = []
    for requirement in result.system.requirements:
        system = replace(result.system, requirements=(requirement,))
        found += said(replace(result, system=system, proofs=Facts(system)))
    return found


@pytest.mark.parametrize("make", [society, counting])
@pytest.mark.parametrize("seeds", blocks([0], also=[1, 2], long=3, each=20))
def test_a_verdict_is_the_same_alone_and_in_company(
    make: Callable[[Random, Path], Result], seeds: Sequence[int], tmp_path: Path
) -> None:
    compared = 0
    for seed in seeds:
        result = make(Random(seed), tmp_path)
        if result.ok:
            together = said(result)
            assert together == alone(result), seed
            compared += len(together)
    assert compared > 1


@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 4), long=6, each=30))
def test_without_measurements_nothing_rests_on_conditions(
    seeds: Sequence[int], tmp_path: Path
) -> None:
    verdicts = set()
    for seed in seeds:
        result = counting(Random(seed), tmp_path)
        if result.ok:
            verdicts |= {each.verdict for each in explore(result.proofs, BUDGET).requirements}
    assert "proved" in verdicts and "open" not in verdicts


COUNTING = """\
specc: 1.2
system: counting
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {t: int}}
      memory: {k: {type: int, init: 0}}
      functions: {go: {k: k + 1, y.b.t: k}}
      behaviours: {go: {functions: [go], terminal: never}}
      states: {S0: go}
      initial_state: S0
  b:
    control:
      rate: 10 Hz
      x: {a: {t: {type: int, init: 0}}}
      behaviours: {w: {terminal: never}}
      states: {S0: w}
      initial_state: S0
require:
  - {that: "always(a.c.k == 9950 implies within(5[s], a.c.k == 10000))", because: it counts}
  - {that: "always(within(5[s], a.c.k > 10000))", because: it does not}
"""


@pytest.mark.long
def test_a_neighbour_does_not_keep_a_counter_from_being_counted(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(COUNTING, encoding="utf-8")
    found = explore(compile_spec(str(tmp_path / "spec.yaml")).proofs, 100_000)
    assert [each.verdict for each in found.requirements] == ["proved", "violated"]


SIGN = """\
specc: 1.2
system: sign
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {t: int}}
      memory: {k: {type: int, init: "-1000"}, s: {type: int, init: "0"}}
      functions: {go: {k: k + 1, s: sign(k), y.b.t: s}}
      behaviours: {go: {functions: [go], terminal: {when: k >= 1000}}, rest: {terminal: never}}
      states: {S0: go, S1: rest}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
  b:
    control:
      rate: 10 Hz
      x: {a: {t: {type: int, init: 0}}}
      behaviours: {w: {terminal: never}}
      states: {S0: w}
      initial_state: S0
require:
  - {that: always(a.c.s != 0), because: asked}
  - {that: always(a.c.s <= 1), because: asked}
  - {that: always(a.c.s < 1), because: asked}
"""


@pytest.mark.long
def test_what_is_the_same_for_all_of_a_line_is_counted(tmp_path: Path) -> None:
    """The sign of a counter is zero at exactly one tick, 100 s after the start."""
    (tmp_path / "spec.yaml").write_text(SIGN, encoding="utf-8")
    found = explore(compile_spec(str(tmp_path / "spec.yaml")).proofs, 100_000)
    assert [each.verdict for each in found.requirements] == ["violated", "proved", "violated"]
    assert [float(f.trace.time_s) for f in found.findings] == [100.0, 100.1]
    assert found.status == "complete"
