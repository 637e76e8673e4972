"""What generated systems say of ages: nothing where nobody asks, else what values rest on."""

from __future__ import annotations

import re
from pathlib import Path

from specc.pipeline import build

SPEC = """\
specc: 1.2
system: two
agents:
  a:
    real_receptors: {k: {y: {d: int, e: int}}}
    virtual_receptors: {k: {through: identity, rate: 20 Hz}}
    control:
      rate: 10 Hz
      x: {k: {d: {type: int, init: 0}, e: {type: int, init: 0}}, b: {n: {type: int, init: 0}}}
      y: {b: {n: int, m: int}}
      memory: {k: {type: int, init: 0}}
      functions:
        sum: {y.b.n: x.k.d + x.b.n}
        new: {y.b.n: "x.k.d if fresh(x.k.e) and x.k.e > 0 else k", y.b.m: k}
      behaviours:
        one: {functions: [sum], terminal: always}
        two: {functions: [new], terminal: always}
      states: {S0: one, S1: two, S2: two}
      initial_state: S0
      transitions:
        - [S0, terminal, always, S1]
        - [S1, terminal, always, S2]
        - [S2, terminal, always, S0]
  b:
    control:
      rate: 10 Hz
      x: {a: {n: {type: int, init: 0LIMIT}, m: {type: int, init: 0}}}
      y: {a: {n: int}}
      memory: {old: {type: "real[s]", init: 0}}
      conditions: {terminal: {odd: x.a.n > 3}}
      functions: {ask: {y.a.n: x.a.n + x.a.m, old: OLD}}
      behaviours: {ask: {functions: [ask], terminal: odd}, rest: {functions: [], terminal: always}}
      states: {A: ask, B: rest}
      initial_state: A
      transitions: [[A, terminal, always, B], [B, terminal, always, A]]
"""


def rules(folder: Path, limit: str = "", old: str = "0") -> list[str]:
    """The lines that the generated system has about ages."""
    path = folder / "two.yaml"
    path.write_text(SPEC.replace("LIMIT", limit).replace("OLD", old))
    built = build(str(path))
    assert built.files, built.result.diagnostics
    return re.findall(r"(?:Behind|MaxAge|MaxCommandAge)\(.*\)(?=,)", built.files["system.py"])


def test_nothing_is_said_where_nobody_asks(tmp_path: Path) -> None:
    assert rules(tmp_path) == []


BEHIND = [
    'Behind("a.c", "b_n", ("S0",), held=("k_d",))',  # x.b.n has been there before
    'Behind("a.c", "b_n", ("S1", "S2"), held=("k_d",), fresh=("k_e",))',
    'Behind("a.k", "c_d", ("through",), held=("R_d",))',
    'Behind("a.k", "c_e", ("through",), held=("R_e",))',
]


def test_values_rest_on_what_was_measured_and_has_not_passed_them(tmp_path: Path) -> None:
    assert rules(tmp_path, old="age(x.a.n)") == BEHIND


def test_limits_know_where_values_are_read(tmp_path: Path) -> None:
    *found, last = rules(tmp_path, ", max_age: 10 s")
    assert found == BEHIND
    assert last.startswith('MaxAge("b.c", "a_n", "x.a.n", 10.0, asked=("A",), used=("A",))')
