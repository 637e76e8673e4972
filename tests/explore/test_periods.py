"""Periods of a machine: the same until a condition turns, none beside a machine that has failed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from specc.tools.explore.explorer import Exploration, explore
from specc.tools.explore.timing import Clocks
from tests.commands import specc
from tests.seeds import every
from tests.soundness.running import compiled
from tests.soundness.specifications import specification

FAILING = """\
specc: 1.1
system: demo
agents:
  counter:
    control:
      rate: 10 Hz
      y: {gate: {n: int}}
      memory: {k: {type: int, init: 0}}
      behaviours: {count: {functions: [{y.gate.n: k, k: "min(k + 1, 9)"}], terminal: never}}
      states: {S0: count}
      initial_state: S0
      assume: [{that: k < 5, because: it fails}]
  gate:
    control:
      rate: 10 Hz
      x: {counter: {n: {type: int, init: 0}}}
      memory: {m: {type: int, init: 0}}
      conditions: {initial: {low: x.counter.n < 9, high: x.counter.n >= 9}}
      behaviours: {look: {functions: [{m: "min(m + 1, 9)"}], terminal: always}}
      states: {S0: look, S1: look}
      initial_state: S0
      transitions:
        - [S0, terminal, low, S0]
        - [S0, terminal, high, S1]
        - [S1, terminal, low, S1]
        - [S1, terminal, high, S0]
      assume: [{that: m < 6, because: the counter has failed before}]
"""
COMPUTED = """\
specc: 1.1
system: demo
constants: {far: "hypot(0.3, 0.4)"}
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {n: int}}
      conditions: {terminal: {late: "elapsed > far * 1[s]"}}
      behaviours: {wait: {functions: [{y.b.n: "1"}], terminal: late}}
      states: {S0: wait, S1: wait}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
  b:
    control:
      rate: 10 Hz
      x: {a: {n: {type: int, init: "0"}}}
      conditions: {terminal: {seen: fresh(x.a.n)}}
      behaviours: {look: {terminal: seen}}
      states: {S0: look}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
require:
  - that: always(state(a.c) == S0 implies within(1.5[s], state(a.c) == S1))
    because: it waits for half a second
"""


def test_nobody_steps_after_a_machine_has_failed(tmp_path: Path) -> None:
    (tmp_path / "failing.yaml").write_text(FAILING, encoding="utf-8")
    done = specc("explore", tmp_path / "failing.yaml")
    assert "gate.c: assumption `m < 6`: proved" in done.stdout
    assert "counter.c: assumption `k < 5`: refuted" in done.stdout


def test_constants_that_no_proof_computes_count_as_times(tmp_path: Path) -> None:
    (tmp_path / "computed.yaml").write_text(COMPUTED, encoding="utf-8")
    assert "state(a.c) == S1))`: proved" in specc("explore", tmp_path / "computed.yaml").stdout


STAYING = """\
specc: 1.2
system: staying
agents:
  a:
    real_effectors: {{m: {{x: {{u: int}}, y: {{b: bool}}}}}}
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {{E: {{b: bool}}}}
        y: {{E: {{u: int}}, c: {{n: int}}}}
        memory:
          n: {{type: int, init: 0}}
          k: {{type: int, init: 0}}
          stayed: {{type: bool, init: "False"}}
        assume: [{{that: k < 1, because: it is tried}}]
        conditions: {{terminal: {{one: x.E.b}}, error: {{other: not x.E.b}}}}
        functions:
          tell: {{y.E.u: n, y.c.n: n}}
          count: {{n: n if n == 1 and not stayed else n + 1, stayed: n == 1}}
          spoil: {{k: k + 1}}
        behaviours:
          look: {{functions: [tell], terminal: one, error: other}}
          work: {{functions: [tell, count], terminal: never}}
          fail: {{functions: [tell, count, spoil], terminal: never}}
        states: {{start: look, good: work, bad: fail}}
        initial_state: start
        transitions: [[start, terminal, always, {one}], [start, error, always, {other}]]
    control:
      rate: 10 Hz
      x: {{m: {{n: {{type: int, init: 0}}}}}}
      conditions: {{terminal: {{much: x.m.n > 5}}}}
      behaviours: {{wait: {{terminal: much}}, end: {{terminal: never}}}}
      states: {{S0: wait, S1: end}}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
require:
  - {{that: "always(not historically(0.1[s], a.m.n == 1))", because: it is tried}}
"""


@pytest.mark.parametrize("targets", [("good", "bad"), ("bad", "good")])
def test_what_is_required_is_judged_for_a_machine_that_failed_and_for_one_that_stayed(
    targets: tuple[str, str], tmp_path: Path
) -> None:
    """Both have the same memory at the same time; a failure excuses only the one that failed."""
    text = STAYING.format(one=targets[0], other=targets[1])
    (tmp_path / "staying.yaml").write_text(text, encoding="utf-8")
    assert "a.m.n == 1))`: may be violated" in specc("explore", tmp_path / "staying.yaml").stdout


@pytest.mark.parametrize("seed", every(12, range(12)))
def test_periods_are_the_same_until_a_condition_turns(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As they are if each is computed for its own clock."""
    text = specification(Random(seed))
    found = _said(text, tmp_path)
    monkeypatch.setattr(Clocks, "turns_passed", lambda self, state, clock, known: clock)
    assert _said(text, tmp_path) == found


def _said(text: str, folder: Path) -> object:
    result = compiled(text, folder)
    if not result.ok:
        return None
    there: Exploration = explore(result.proofs, 3000)
    findings = [replace(each.diagnostic, fix=None) for each in there.findings]
    return there.slices, findings, there.assumptions
