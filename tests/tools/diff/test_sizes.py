"""Operators of descriptions with whole numbers for parameters: only sizes make another operator."""

from __future__ import annotations

from pathlib import Path

from specc.model.system import System
from specc.pipeline import read_spec
from specc.tools.diff import compare

PART = """specc: 1.2
parameters: {me: int, n: int}
types: {Pair: {fields: {v: "vector[n, m]"}}}
files: {data: part.yaml}
operators:
  twice: {signature: "(v: int) -> int", python: "ops:twice"}
  first: {signature: "(pairs: list[Pair]) -> int", python: "ops:first"}
subsystem:
  rate: 10 Hz
  x: {R: {p: int}}
  y: {c: {q: int, r: int}}
  functions: {f: {y.c.q: twice(x.R.p) + me, y.c.r: "first([])"}}
  behaviours: {b: {functions: [f], terminal: never}}
  states: {S0: b}
  initial_state: S0
"""
SYSTEM = """specc: 1.1
system: two
agents:
  "a_{k}":
    for: {k: 1..2}
    real_receptors: {d: {y: {p: int}}}
    virtual_receptors: {d: {use: part.yaml, with: {me: k, n: 3}}}
    control:
      rate: 10 Hz
      x: {d: {q: int, r: int}}
      behaviours: {b: {terminal: never}}
      states: {S0: b}
      initial_state: S0
"""


def systems(folder: Path, *edit: str) -> tuple[System, System]:
    (folder / "part.yaml").write_text(PART)
    (folder / "old.yaml").write_text(SYSTEM)
    (folder / "new.yaml").write_text(SYSTEM.replace(*edit))
    old, new = (read_spec(str(folder / f"{name}.yaml")).system for name in ("old", "new"))
    assert old is not None
    assert new is not None
    return old, new


def test_numbers_that_are_no_sizes_change_no_operator(tmp_path: Path) -> None:
    old, new = systems(tmp_path, "1..2", "2..3")
    assert [operator.name for operator in old.operators] == ["twice", "first@part.yaml#n=3"]
    found = compare(old, new).changes
    assert [(c.part, c.name, c.change) for c in found] == [
        ("agent", "a_1", "removed"),
        ("agent", "a_3", "added"),
    ]


def test_a_size_in_a_named_type_makes_another_operator(tmp_path: Path) -> None:
    _, new = systems(tmp_path, "n: 3", "n: 4")
    assert [operator.name for operator in new.operators] == ["twice", "first@part.yaml#n=4"]
