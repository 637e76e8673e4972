"""What is searched for a refutation are values of their types, in situations that can occur."""

from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from tests.seeds import every

TEXT = """specc: 1
system: demo
types: {Rec: {fields: {n: int}, python: "demo.ops:Rec"}}
operators:
  counted: {signature: "(a: int) -> int", python: "demo.ops:counted"}
  new_rec: {signature: "(n: int) -> Rec", python: "demo.ops:new_rec"}
agents:
  a:
    control:
      rate: 10 Hz
      y: {m: {n: int, l: "nonempty[real]", r: Rec}}
      functions: {send: {y.m.n: 1, y.m.l: "[1.0]", y.m.r: new_rec(1)}}
      behaviours: {work: {functions: [send], terminal: never}}
      states: {S0: work}
      initial_state: S0
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {c: {n: {type: int, init: 0}, l: "nonempty[real]", r: Rec}}
        memory: {k: {type: int, init: 0}}
        conditions:
          initial:
            low: LOW
            high: HIGH
        functions: {count: {k: k + 1}}
        behaviours: {wait: {functions: [count], terminal: always}}
        states: {S0: wait}
        initial_state: S0
        transitions:
          - [S0, terminal, low, S0]
          - [S0, terminal, high, S0]
"""
COMPLETE = [
    ("x.c.n * 2 < 5", "x.c.n >= 3"),
    ("k * 2 < 5", "k >= 3"),
    ("k + 0.5 < 3", "k >= 3"),
    ("x.c.n / 2 < 1.2", "x.c.n >= 3"),
    ("x.c.n * 1.0 <= 2.5", "x.c.n >= 3"),
    ("x.c.r.n * 2 < 5", "x.c.r.n >= 3"),
    ("counted(k) * 2 < 5", "counted(k) >= 3"),
    ("len(x.c.l) * 2 >= 3", "len(x.c.l) < 2 and len(x.c.l) > 0"),
    ("fresh(x.c.n) and x.c.n <= 4", "fresh(x.c.n) and x.c.n + x.c.n >= 10"),
]
"""Rows that tables leave open, and of which exactly one applies to all values of the types."""


@pytest.mark.parametrize(("low", "high"), every(2, COMPLETE))
def test_rows_that_are_complete_are_not_refuted(low: str, high: str, tmp_path: Path) -> None:
    spec = tmp_path / "demo.yaml"
    spec.write_text(TEXT.replace("LOW", f'"{low}"').replace("HIGH", f'"{high}"'))
    found = [(d.code, d.message, d.example) for d in compile_spec(str(spec)).diagnostics]
    assert not [each for each in found if each[0][0] == "E"], found


@pytest.mark.parametrize(("low", "high", "value"), [("x.c.n * 2 < 5", "x.c.n >= 4", "3")])
def test_a_gap_between_whole_numbers_is_found(
    low: str, high: str, value: str, tmp_path: Path
) -> None:
    spec = tmp_path / "demo.yaml"
    spec.write_text(TEXT.replace("LOW", f'"{low}"').replace("HIGH", f'"{high}"'))
    (gap,) = (d for d in compile_spec(str(spec)).diagnostics if d.code == "E0601")
    assert gap.example == f"`x.c.n` = {value}"
