"""Rows that are proved for numbers, and fail for NaN, are checked in every run."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from tests.soundness.open_inputs import Findings, tried

SPEC = """
specc: 1
system: small
operators: {ODD: {signature: "(said: bool) -> bool", python: "small:odd"}}
agents:
  a:
    control:
      {rate: 10 Hz, behaviours: {rest: {terminal: never}}, states: {S0: rest}, initial_state: S0}
    real_effectors: {m: {x: {u: real}, y: {p: real, q: real, v: "vector[2]"}}}
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {E: {p: real, q: real, v: "vector[2]"}}
        y: {E: {u: real}}
        conditions:
          initial: %s
          terminal: {ended: "%s"}
        functions: {rest: {y.E.u: 0}}
        behaviours: {rest: {functions: [rest], terminal: ended}}
        states: {S0: rest}
        initial_state: S0
        transitions: %s
"""
ODD = (math.nan, math.inf, -math.inf, 1.0)
SMALL, LARGE = "any(c < 1 for c in x.E.v)", "any(c >= 1 for c in x.E.v)"


@pytest.mark.parametrize(
    ("rows", "ended"),
    [
        (
            [SMALL, f"not {SMALL} and x.E.v[0] < 5", f"{LARGE} and not ({SMALL} or x.E.v[0] < 5)"],
            "elapsed > 0",
        ),
        (["(1 if x.E.p >= 1 else 2) + (1 if x.E.p < 1 else 2) == 3"], "elapsed > 0"),
        (["ODD(x.E.p < 1)", "not ODD(not x.E.p >= 1)"], "elapsed > 0"),
        (["near(x.E.p, x.E.q, 1)"], "x.E.p <= x.E.q and x.E.q <= x.E.p"),
    ],
    ids=["quantifier", "choice", "argument", "infinities"],
)
def test_what_fails_for_nan_is_checked(rows: list[str], ended: str, tmp_path: Path) -> None:
    initial = ", ".join(f'r{number}: "{row}"' for number, row in enumerate(rows))
    table = ", ".join(f"[S0, terminal, r{number}, S0]" for number in range(len(rows)))
    path = tmp_path / "small.yaml"
    path.write_text(SPEC % (f"{{{initial}}}", ended, f"[{table}]"), encoding="utf-8")
    result = compile_spec(str(path))
    assert result.ok
    findings = Findings()
    for seed in range(4):
        tried(result, str(seed), 400, findings, odd=ODD)
    assert findings.faults == []
    assert findings.ended["undecided where it is not proved"]
