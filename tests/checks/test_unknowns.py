"""An error hides what depends on it, and nothing else: no proof rests on it, the rest is proved."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import compile_spec

SPEC = """\
specc: 1
system: demo
agents:
  a:
    control:
      rate: 10 Hz
      x: {m: {d: "real[m]"}}
      y: {m: {go: bool, stop: bool}}
      functions: {send: {y.m.go: True, y.m.stop: "present(x.m.d) and x.m.d > 1[m]"}}
      behaviours: {work: {functions: [send], terminal: never}}
      states: {S0: work}
      initial_state: S0
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {c: {go: {type: bool, init: False}, stop: {type: bool, init: False}}}
        y: {c: {d: "real[m]"}}
        memory: {d_d: {type: "real[m]", init: 0}}
        let: {going: x.c.go and not x.c.stop}
        conditions:
          initial:
            go: going
            stay: not going
            halted: fresh(x.c.stop)
            moving: not fresh(x.c.stop)
          terminal: {told: fresh(x.c.go)}
        functions:
          hold: {y.c.d: d_d}
          move: {y.c.d: d_d, d_d: "d_d + 0.001[m]"}
        behaviours:
          idle: {functions: [hold], terminal: told}
          move: {functions: [move], terminal: always}
        states: {S0: idle, S1: move}
        initial_state: S0
        transitions:
          - [S0, terminal, go, S1]
          - [S0, terminal, stay, S0]
          - [S1, terminal, halted, S0]
          - [S1, terminal, moving, S1]
"""


def codes(folder: Path, *changes: tuple[str, str]) -> list[str]:
    """Codes of the findings about the specification with some of its text changed."""
    text = SPEC
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "demo.yaml").write_text(text, encoding="utf-8")
    return sorted(found.code for found in compile_spec(str(folder / "demo.yaml")).diagnostics)


FAULTS = {
    "initial condition": (("go: going", "go: goign"), "E0201"),
    "let that conditions name": (("x.c.go and not", "x.c.ho and not"), "E0203"),
    "terminal condition": (("told: fresh(x.c.go)", "told: fresh(x.c.ho)"), "E0203"),
    "condition of a row": (("[S1, terminal, halted", "[S1, terminal, halt"), "E0212"),
    "condition of a behaviour": (("terminal: told", "terminal: toled"), "E0212"),
    "value of a target": (("y.c.d: d_d, d_d", "y.c.d: d_c, d_d"), "E0201"),
    "target": (("{y.c.d: d_d}", "{y.c.e: d_d}"), "E0214"),
    "function of a behaviour": (("[hold], terminal", "[hodl], terminal"), "E0215"),
    "behaviour of a state": (("S1: move}", "S1: moev}"), "E0216"),
    "memory": (('"real[m]", init: 0}', '"real[m]", init: "1[s]"}'), "E0310"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_an_error_brings_no_others(fault: str, tmp_path: Path) -> None:
    change, code = FAULTS[fault]
    assert codes(tmp_path) == []
    assert codes(tmp_path, change) == [code]


REST = {
    "overlap": (("moving: not fresh(x.c.stop)", "moving: fresh(x.c.go) or x.c.go"), "E0602"),
    "gap": (("moving: not fresh(x.c.stop)", "moving: x.c.go and not fresh(x.c.stop)"), "E0601"),
    "unreached": (("[S0, terminal, go, S1]", "[S0, terminal, go, S0]"), "W0607"),
}
ELSEWHERE = ["initial condition", "value of a target", "target", "function of a behaviour"]


@pytest.mark.parametrize("rest", ["gap", "unreached"])
@pytest.mark.parametrize("fault", ELSEWHERE)
def test_what_does_not_depend_on_an_error_is_proved(fault: str, rest: str, tmp_path: Path) -> None:
    wrong, code = FAULTS[fault]
    change, proved = REST[rest]
    if rest == "unreached" and fault == "initial condition":
        wrong = ("halted: fresh(x.c.stop)", "halted: fresh(x.c.stpo)")
        code = "E0203"
    assert codes(tmp_path, wrong, change) == sorted([code, proved])


def test_two_known_rows_overlap_beside_an_unknown_one(tmp_path: Path) -> None:
    more = (
        "- [S1, terminal, halted, S0]\n",
        "- [S1, terminal, halted, S0]\n" + " " * 10 + "- [S1, terminal, unheard, S0]\n",
    )
    assert codes(tmp_path, more) == ["E0212"]
    assert codes(tmp_path, more, REST["overlap"][0]) == ["E0212", "E0602"]
    moved = ("[S1, terminal, moving", "[S1, terminal, halted")
    assert codes(tmp_path, more, moved) == ["E0212", "E0602"]
