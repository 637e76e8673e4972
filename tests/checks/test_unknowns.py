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
      rate: 5 Hz
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
    "let that conditions name": (("x.c.go and not", "x.c.goo and not"), "E0201"),
    "terminal condition": (("told: fresh(x.c.go)", "told: fresh(x.c.goo)"), "E0201"),
    "condition of a row": (("[S1, terminal, halted", "[S1, terminal, haltd"), "E0201"),
    "condition of a behaviour": (("terminal: told", "terminal: toled"), "E0201"),
    "value of a target": (("y.c.d: d_d, d_d", "y.c.d: d_dd, d_d"), "E0201"),
    "target": (("{y.c.d: d_d}", "{y.c.dd: d_d}"), "E0201"),
    "function of a behaviour": (("[hold], terminal", "[hodl], terminal"), "E0201"),
    "behaviour of a state": (("S1: move}", "S1: moev}"), "E0201"),
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
NEEDLESS = (
    "          - [S1, terminal, moving, S1]\n",
    "          - [S1, terminal, moving, S1]\n"
    "        assume:\n"
    '          - {that: "d_d < 1[m] or fresh(x.c.go)", because: it is slow}\n',
)


@pytest.mark.parametrize("fault", ["value of a target", "target", "memory"])
def test_an_assumption_that_nothing_needs_is_told_beside_an_error(
    fault: str, tmp_path: Path
) -> None:
    wrong, code = FAULTS[fault]
    assert codes(tmp_path, NEEDLESS) == ["W0610"]
    assert codes(tmp_path, wrong, NEEDLESS) == sorted([code, "W0610"])


def test_an_assumption_may_be_meant_for_rows_that_are_wrong(tmp_path: Path) -> None:
    change, code = REST["gap"]
    about_it = ("d_d < 1[m] or fresh(x.c.go)", "x.c.go or fresh(x.c.go)")
    assert codes(tmp_path, NEEDLESS, about_it) == ["W0610"]
    assert codes(tmp_path, change, NEEDLESS) == [code, "W0610"]
    assert codes(tmp_path, change, NEEDLESS, about_it) == [code]


SEEN = Path(__file__).resolve().parents[1] / "cases/presence/E0705-nothing-seen.yaml"
TWICE = "[[S0, terminal, always, S1], [S0, terminal, always, S0]]"


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("y.E.width: 0}", 'y.E.width: "1[s]"}', "E0310"),
        ("[look, wait]", "[look, wiat]", "E0201"),
        ("[[S0, terminal, always, S1]]", TWICE, "E0602"),
    ],
)
def test_an_item_that_may_not_be_there_is_told_beside_an_error(
    old: str, new: str, code: str, tmp_path: Path
) -> None:
    text = SEEN.read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "demo.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    assert sorted(d.code for d in compile_spec(str(path)).diagnostics) == sorted(["E0705", code])


ELSEWHERE = ["initial condition", "value of a target", "target", "function of a behaviour"]


@pytest.mark.parametrize("rest", ["gap", "unreached"])
@pytest.mark.parametrize("fault", ELSEWHERE)
def test_what_does_not_depend_on_an_error_is_proved(fault: str, rest: str, tmp_path: Path) -> None:
    wrong, code = FAULTS[fault]
    change, proved = REST[rest]
    if rest == "unreached" and fault == "initial condition":
        wrong = ("halted: fresh(x.c.stop)", "halted: fresh(x.c.stpo)")
        code = "E0201"
    assert codes(tmp_path, wrong, change) == sorted([code, proved])


def test_two_known_rows_overlap_beside_an_unknown_one(tmp_path: Path) -> None:
    more = (
        "- [S1, terminal, halted, S0]\n",
        "- [S1, terminal, halted, S0]\n" + " " * 10 + "- [S1, terminal, haltd, S0]\n",
    )
    assert codes(tmp_path, more) == ["E0201"]
    assert codes(tmp_path, more, REST["overlap"][0]) == ["E0201", "E0602"]
    moved = ("[S1, terminal, moving", "[S1, terminal, halted")
    assert codes(tmp_path, more, moved) == ["E0201", "E0602"]


PARTS = {
    "an overlap is one whatever else a row asks": (
        ("moving: not fresh(x.c.stop)", "moving: fresh(x.c.stop) or goign"),
        ["E0201", "E0602"],
    ),
    "a row that may hold elsewhere overlaps nothing": (
        ("moving: not fresh(x.c.stop)", "moving: goign or not fresh(x.c.stop)"),
        ["E0201"],
    ),
    "a row that may apply elsewhere leaves no gap": (
        ("moving: not fresh(x.c.stop)", "moving: not fresh(x.c.stop) and x.c.go or goign"),
        ["E0201"],
    ),
    "a gap is one whatever a row asks besides": (
        ("moving: not fresh(x.c.stop)", "moving: not fresh(x.c.stop) and x.c.go and not goign"),
        ["E0201", "E0601"],
    ),
    "what an unknown operand of `not` is does not matter": (
        ("moving: not fresh(x.c.stop)", "moving: fresh(x.c.stop) or not (going and goign)"),
        ["E0201", "E0602"],
    ),
    "an exact comparison is what it says": (
        ("told: fresh(x.c.go)", "told: d_d == 0"),
        ["E0319"],
    ),
}


@pytest.mark.parametrize("case", PARTS)
def test_what_holds_whatever_a_part_of_a_condition_is(case: str, tmp_path: Path) -> None:
    change, expected = PARTS[case]
    assert codes(tmp_path, change) == expected


def test_rows_overlap_when_a_refused_comparison_holds(tmp_path: Path) -> None:
    wrong = ("told: fresh(x.c.go)", "told: d_d == 0")
    both = ("stay: not going", "stay: not going or fresh(x.c.go)")
    assert codes(tmp_path, wrong, both) == ["E0319", "E0602"]


READER = (
    "functions: [send], terminal: never}}\n      states: {S0: work}\n",
    "functions: [send], terminal: far}}\n      states: {S0: work}\n"
    '      conditions: {terminal: {far: "x.m.d > 1[m]"}}\n'
    "      transitions: [[S0, terminal, always, S0]]\n",
)
SILENT = ("{y.c.d: d_d}", "{d_d: 2 * d_d}")
SENDERS = {
    "a value with an error is sent all the same": (
        (),
        ("y.c.d: d_d}", "y.c.d: d_dd}"),
        "E0201",
        False,
    ),
    "an error elsewhere": ((SILENT,), ("y.c.d: d_d, d_d", "y.c.d: d_dd, d_d"), "E0201", True),
    "a condition with an error": ((SILENT,), ("go: going", "go: goign"), "E0201", True),
    "a behaviour with an error": (
        (SILENT,),
        ("[move], terminal", "[mvoe], terminal"),
        "E0201",
        True,
    ),
    "an unknown target may be it": ((), ("{y.c.d: d_d}", "{y.c.dd: d_d}"), "E0201", False),
    "an unknown function may send it": (
        (SILENT,),
        ("[hold], t", "[hold, hodl], t"),
        "E0201",
        False,
    ),
    "an unknown behaviour may send it": ((SILENT,), ("S0: idle", "S0: idel"), "E0201", False),
    "what has no initial state": (
        (SILENT,),
        ("initial_state: S0\n        tr", "tr"),
        "O0602",
        False,
    ),
}


@pytest.mark.parametrize("case", SENDERS)
def test_a_reader_of_a_sender_with_errors(case: str, tmp_path: Path) -> None:
    """It is known that a value need not have come unless what is wrong may send it."""
    before, wrong, code, known = SENDERS[case]
    assert codes(tmp_path, READER, *before) == (["E0702"] if before else [])
    expected = sorted([code, *(["E0702"] if known else [])])
    assert codes(tmp_path, READER, *before, wrong) == expected


def test_a_sender_without_a_rate_may_be_fast_enough(tmp_path: Path) -> None:
    faster = ("rate: 5 Hz\n      x: {m", "rate: 20 Hz\n      x: {m")
    unrated = ("m:\n        rate: 10 Hz\n", "m:\n")
    assert codes(tmp_path, READER, faster) == ["E0702"]
    assert codes(tmp_path, READER, faster, unrated) == ["O0601"]


def test_a_known_way_into_a_state_is_followed_beside_an_unknown_one(tmp_path: Path) -> None:
    reads = ('d_d: "d_d + 0.001[m]"', 'd_d: "d_d if x.c.late else 0"')
    late = ("stop: {type: bool, init: False}}", "stop: {type: bool, init: False}, late: bool}")
    sent = (("go: bool, stop", "late: bool, go: bool, stop"),)
    unknown = ("[S0, terminal, stay, S0]", "[S0, terminal, stya, S1]")
    told = sorted(["E0201", "E0701"])
    assert codes(tmp_path, *sent, late, reads, unknown) == told
    whole = ("terminal: told}", "terminal: toldd}")
    assert codes(tmp_path, *sent, late, reads, whole) == ["E0201"]


def test_a_condition_of_another_kind_is_no_part_to_come(tmp_path: Path) -> None:
    assert codes(tmp_path, ("[S0, terminal, go, S1]", "[S0, terminal, told, S1]")) == ["E0201"]


AWAITED = {
    "buffer of a subsystem": [("y: {c: {d:", "y: {gripper: {closed: bool}, c: {d:")],
    "input that is read": [
        ("x: {c: {go:", "x: {gripper: {closed: bool}, c: {go:"),
        ("told: fresh(x.c.go)", "told: x.gripper.closed or fresh(x.c.go)"),
    ],
    "device": [("rate: 10 Hz\n        x:", "rate: 10 Hz\n        uses: [gripper]\n        x:")],
    "device with a buffer": [
        (
            "rate: 10 Hz\n        x: {c:",
            "rate: 10 Hz\n        uses: [t]\n        x: {E: {d: int}, c:",
        )
    ],
    "agent": [("x: {m: {d:", "x: {conveyor: {v: int}, m: {d:")],
}
"""Other ends that are not there yet."""


@pytest.mark.parametrize("case", AWAITED)
def test_an_end_that_is_not_there_yet_hides_nothing_else(case: str, tmp_path: Path) -> None:
    gap = ("moving: not fresh(x.c.stop)", "moving: not fresh(x.c.stop) and x.c.go")
    end = ("stop: bool}}", "stop: bool}, stranger: {go: bool}}")
    assert codes(tmp_path, *AWAITED[case]) == ["O0205"]
    assert codes(tmp_path, *AWAITED[case], gap) == ["E0601", "O0205"]
    assert codes(tmp_path, *AWAITED[case], end) == ["O0205", "O0205"]
