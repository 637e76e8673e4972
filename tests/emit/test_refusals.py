"""What cannot become code is a finding, never an exception."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc import emit, lower, pipeline

HEAD = """\
specc: 1
system: long
agents:
  a:
    real_receptors: {r: {x: {k: real}}}
    control:
      rate: 10 Hz
      y: {R: {k: real}}
      memory: {k: {type: real, init: 1}}
      let:
        l0: k
"""
TAIL = """\
      functions: {f: {y.R.k: k, k: LAST}}
      behaviours: {b: {functions: [f], terminal: never}}
      states: {S: b}
      initial_state: S
"""


def build(path: Path, lets: int) -> pipeline.Build:
    text = [f"        l{i}: l{i - 1} + l{i - 1} * k\n" for i in range(1, lets)]
    path.write_text(HEAD + "".join(text) + TAIL.replace("LAST", f"l{lets - 1}"))
    return pipeline.build(str(path))


def errors(built: pipeline.Build) -> list[str]:
    return [d.code for d in built.result.diagnostics if d.severity == "error"]


def test_lets_that_depend_on_a_hundred_others(tmp_path: Path) -> None:
    built = build(tmp_path / "deep.yaml", 900)
    assert errors(built) == ["E0303"]
    assert built.files == {}


def test_lets_that_are_used_twice_by_the_next_cost_no_more(tmp_path: Path) -> None:
    assert errors(build(tmp_path / "wide.yaml", 100)) == []


def test_terms_beyond_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*given: object) -> None:
        raise lower.TooLarge("a.c")

    monkeypatch.setattr(lower, "lower", refuse)
    assert errors(build(tmp_path / "large.yaml", 1)) == ["E0093"]


def test_without_the_formatter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(plan: object) -> dict[str, str]:
        raise emit.FormatError("ruff is not installed")

    monkeypatch.setattr(emit, "emit", missing)
    built = build(tmp_path / "small.yaml", 1)
    assert errors(built) == ["E0094"]
    assert not built.result.ok
