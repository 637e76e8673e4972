"""A step that fails ends the run, so that what is required of later ticks stays unknown."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from specc.tools.explore.explorer import explore
from tests.explore.verdicts import monitored

FAILING = """\
specc: 1.2
system: failing
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {t: real}}
      memory: {k: {type: int, init: 0}}
      let: {v: 1 / (k + 1)}
      conditions: {initial: {one: "FIRST", other: "not FIRST"}, terminal: {ends: "ENDS"}}
      functions: {go: {k: k + 1, y.b.t: "SENT"}}
      behaviours: {go: {functions: [go], terminal: ends}, rest: {terminal: never}}
      states: {S0: go, S1: rest}
      initial_state: S0
      transitions: [[S0, terminal, one, S0], [S0, terminal, other, S0]]
  b:
    control:
      rate: 10 Hz
      x: {a: {t: {type: real, init: 0}}}
      behaviours: {w: {terminal: never}}
      states: {S0: w}
      initial_state: S0
require:
  - {that: always(a.c.k < 50), because: asked}
  - {that: always(a.c.k <= 5), because: asked}
  - {that: always(a.c.k < 5), because: asked}
"""


@pytest.mark.parametrize(
    ("ends", "sent", "first"),
    [
        ("1 / (k - 5) > 100 or k > 100", "0", "k > 0"),
        ("1 / (k - 5) > 100 or k > 4", "0", "k > 0"),
        ("not (sqrt(4 - k) >= 0)", "0", "k > 0"),
        ("(k > 100 if 1 / (k - 5) > 100 else k > 200)", "0", "k > 0"),
        ("k > 100", "1 / (k - 5)", "k > 0"),
        ("k > 100", "v / (k - 5)", "k > 0"),
        ("k >= 5", "0", "1 / (k - 5) > 1"),
    ],
)
def test_a_run_that_fails_violates_nothing_after_it(
    ends: str, sent: str, first: str, tmp_path: Path
) -> None:
    text = FAILING.replace("ENDS", ends).replace("SENT", sent).replace("FIRST", first)
    (tmp_path / "spec.yaml").write_text(text, encoding="utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    assert result.ok, result.diagnostics
    said, lasted_s = monitored(result, 0, 40)
    assert (said, float(lasted_s)) == (["unknown", "unknown", "violated"], 0.5)
    found = explore(result.proofs, 10_000)
    words = "proved until a step fails"
    assert [each.verdict for each in found.requirements] == ["proved", "proved", "violated"]
    assert [each.summary() for each in found.requirements[:2]] == [words, words]


@pytest.mark.parametrize("ends", ["k > 100 and 1 / (k - 5) > 1", "k < 100 or 1 / (k - 5) > 1"])
def test_what_is_not_computed_does_not_fail(ends: str, tmp_path: Path) -> None:
    text = FAILING.replace("ENDS", ends).replace("SENT", "0").replace("FIRST", "k > 0")
    (tmp_path / "spec.yaml").write_text(text, encoding="utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    said, _ = monitored(result, 0, 70)
    found = explore(result.proofs, 10_000)
    assert said == [each.verdict for each in found.requirements] == ["violated"] * 3


def test_the_first_step_may_fail(tmp_path: Path) -> None:
    text = FAILING.replace("ENDS", "k > 100").replace("SENT", "1 / k").replace("FIRST", "k > 0")
    (tmp_path / "spec.yaml").write_text(text, encoding="utf-8")
    result = compile_spec(str(tmp_path / "spec.yaml"))
    said, lasted_s = monitored(result, 0, 40)
    assert set(said) == {"unknown"} and not lasted_s
    assert {each.verdict for each in explore(result.proofs, 10_000).requirements} == {"proved"}
