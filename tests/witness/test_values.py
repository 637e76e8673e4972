"""What scenarios feed: numbers between thresholds, operators, poses, lists, time, memory."""

from __future__ import annotations

from pathlib import Path
from unittest import SkipTest

import pytest
from specc_runtime.faults import UndecidedTransition

from specc.cli import main
from tests.seeds import short
from tests.witness.runs import run, written

HEAD = """\
specc: 1
system: demo
frames: {B: base, E: end}
types: {Mode: "enum[u, c, s]", Item: {fields: {d: "real[m]", mode: Mode}}}
operators:
  IS_SAFE: {signature: "(d: real) -> bool", python: "tool:is_safe"}
  SIZE: {signature: "(items: list[Item]) -> real", python: "tool:size"}
  WHERE: {signature: "(d: real) -> pose[B, E]", python: "tool:where"}
constants: {limit: "2.5"}
agents:
  a:
    control:
      rate: 10 Hz
      y: {m: {d: real, modes: "vector[3, Mode]", X: "pose[B, E]", items: "list[Item]", go: int}}
      functions:
        send: {y.m.d: 1, y.m.modes: "[u, u, u]", y.m.X: WHERE(1), y.m.items: "[]", y.m.go: 1}
      behaviours: {work: {functions: [send], terminal: never}}
      states: {S0: work}
      initial_state: S0
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {c: {d: real, modes: "vector[3, Mode]", X: "pose[B, E]", items: "list[Item]", go: int}}
        memory: {n: {type: int, init: 0}, v: {type: "vector[3]", init: "[0, 0, 0]"}}
        functions: {count: {n: n + 1, v: "v * 2"}}
        let: {twice: 2 * x.c.d}
        conditions:
          initial: {one: "ONE", two: "TWO", neither: "not (ONE) and not (TWO)"}
          terminal: {late: "elapsed > 0.35[s]"}
        behaviours: {idle: {functions: [count], terminal: late}}
        states: {S0: idle}
        initial_state: S0
        transitions:
          - [S0, terminal, one, S0]
          - [S0, terminal, two, S0]
          - [S0, terminal, neither, S0]
"""
OVERLAPS = {
    "numbers": ("x.c.d > limit", "x.c.d < 2.501"),
    "sums": ("twice + 1 > limit", "x.c.d - twice > -1"),
    "operators": ("IS_SAFE(x.c.d)", "x.c.d > 1"),
    "the same operator twice": ("IS_SAFE(x.c.d)", "not IS_SAFE(x.c.d + 1)"),
    "an operator of an operator": ("SIZE(x.c.items) > 3", "IS_SAFE(SIZE(x.c.items))"),
    "some and all": ("any(m == s for m in x.c.modes)", "any(m == c for m in x.c.modes)"),
    "components": ("x.c.modes[0] == s", "x.c.modes[2] in {u, c}"),
    "vectors of members": ("x.c.modes == [u, c, x.c.modes[0]]", "x.c.modes != [u, u, u]"),
    "lists": ("len(x.c.items) > 1", "all(i.mode == s and i.d > 2[m] for i in x.c.items)"),
    "poses": ("near(x.c.X, WHERE(1), 0.1[m], 0.1[rad])", "not near(x.c.X, WHERE(2), 1[m], 1[rad])"),
    "memory": ("n > 2", "n < 6"),
    "vectors": ("norm(v - [1, 0, 0]) < 3", "x.c.go > 3"),
    "choices": ("(x.c.d if x.c.go > 2 else -x.c.d) > 1", "x.c.d < -1"),
    "ages": ("age(x.c.d) > 0.5[s] and late(x.c.go) == 2", "age(x.c.d) + age(x.c.go) > 1[s]"),
    "freshness": ("present(x.c.d) and fresh(x.c.go)", "present(x.c.items)"),
}


def spec(tmp_path: Path, one: str, two: str) -> Path:
    path = tmp_path / "spec.yaml"
    path.write_text(HEAD.replace("ONE", one).replace("TWO", two), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", short(OVERLAPS, *range(0, len(OVERLAPS), 2)))
def test_values_that_make_two_rows_apply(name: str, tmp_path: Path) -> None:
    one, two = OVERLAPS[name]
    path = spec(tmp_path, one, two)
    (scenario,) = written(path, tmp_path / "out", "--code", "E0602")
    error = run(scenario, tmp_path)
    assert isinstance(error, UndecidedTransition)
    assert error.rows == ("S0 terminal one -> S0", "S0 terminal two -> S0")
    text = scenario.read_text(encoding="utf-8")
    assert ".place(" not in text
    assert ("depends on operators" in text) == (".operator(" in text)
    text = path.read_text(encoding="utf-8")
    path.write_text(
        text.replace(f'two: "{two}"', f'two: "({two}) and not ({one})"'), encoding="utf-8"
    )
    assert run(scenario, tmp_path) is None


def test_it_waits_until_it_is_time(tmp_path: Path) -> None:
    (scenario,) = written(spec(tmp_path, "x.c.go > 1", "x.c.go > 2"), tmp_path / "out")
    assert "# it goes on" in scenario.read_text(encoding="utf-8")
    assert isinstance(run(scenario, tmp_path), UndecidedTransition)


def test_memory_that_no_run_gives_is_put_in_place(tmp_path: Path) -> None:
    (scenario,) = written(spec(tmp_path, "n > 2", "n < -6 or n > 100000"), tmp_path / "out")
    text = scenario.read_text(encoding="utf-8")
    assert "# No inputs were found that lead to these values" in text
    assert "trial.place(memory={" in text
    assert isinstance(run(scenario, tmp_path), UndecidedTransition)


def test_what_cannot_be_shown_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = spec(tmp_path, "x.c.go > 1", "x.c.go > 2")
    monkeypatch.setattr("specc.tools.witness.plan.find", lambda *_, **__: None)
    assert main(["witness", str(path), "--code", "E0602", "--out", str(tmp_path / "out")]) == 1
    assert "no values were found with which a run shows this" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_another_way_through_the_table_skips(tmp_path: Path) -> None:
    path = spec(tmp_path, "x.c.go > 1", "x.c.go > 2")
    (scenario,) = written(path, tmp_path / "out")
    path.write_text(
        path.read_text(encoding="utf-8")
        .replace("S0: idle", "S1: idle")
        .replace("initial_state: S0\n        transitions", "initial_state: S1\n        transitions")
        .replace("[S0, ", "[S1, ")
        .replace(", S0]", ", S1]"),
        encoding="utf-8",
    )
    with pytest.raises(SkipTest, match="run `specc witness` again"):
        run(scenario, tmp_path)


ALIKE = """\
specc: 1
system: alike
operators:
  größe: {signature: "(n: int) -> int", python: "operator:neg"}
  grüße: {signature: "(n: int) -> bool", python: "operator:truth"}
agents:
  a:
    control:
      rate: 10 Hz
      x: {b: {n: {type: int, init: 0}}}
      let: {p: größe(x.b.n) > 5, q: grüße(x.b.n)}
      conditions: {initial: {p: p, q: q, r: not p and not q}}
      behaviours: {w: {functions: [], terminal: always}}
      states: {S0: w}
      initial_state: S0
      transitions: [[S0, terminal, p, S0], [S0, terminal, q, S0], [S0, terminal, r, S0]]
  b:
    control:
      rate: 10 Hz
      y: {a: {n: int}}
      behaviours: {w: {functions: [{y.a.n: 1}], terminal: never}}
      states: {S0: w}
      initial_state: S0
"""


@pytest.mark.long
def test_operators_of_one_identifier(tmp_path: Path) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(ALIKE, encoding="utf-8")
    (scenario,) = written(path, tmp_path / "out", "--code", "E0602")
    assert isinstance(run(scenario, tmp_path), UndecidedTransition)
