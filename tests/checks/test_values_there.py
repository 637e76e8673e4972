"""Optional values and items of lists are tested before they are taken for granted (E0705)."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import compile_spec

SPEC = """
specc: 1
system: pick
types: {Thing: {fields: {x: "real[m]", c: real}}}
operators:
  FIND: {signature: "(t: real[s]) -> list[Thing]", python: "ops:find"}
  LOOK: {signature: "(t: real[s]) -> optional[Thing]", python: "ops:look"}
  BEST: {signature: "(o: nonempty[Thing]) -> Thing", python: "ops:best"}
  NEAR: {signature: "(o: optional[Thing]) -> bool", python: "ops:near"}
agents:
  a:
    real_effectors: {m: {x: {d: "real[m]"}, y: {q: "real[m]", t: "real[s]"}}}
    control: {rate: 10 Hz, behaviours: {b: {terminal: never}}, states: {S0: b}, initial_state: S0}
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {E: {q: "real[m]", t: "real[s]"}}
        y: {E: {d: "real[m]"}}
        memory:
          seen: {type: "list[Thing]", init: "[]"}
          goal: {type: "optional[Thing]", init: None}
        let:
          best: argmax(o.c for o in seen)
          first: BEST(seen)
          found: FIND(x.E.t)
        conditions:
          terminal: {found_some: "FOUND", aimed: "AIMED"}
        functions:
          look: {seen: found, goal: LOOK(x.E.t)}
          hold: {y.E.d: "HOLD"}
          go: {y.E.d: "GO"}
          reach: {y.E.d: "REACH"}
        behaviours:
          search: {functions: [look, hold], terminal: found_some}
          move: {functions: [go], terminal: aimed}
          approach: {functions: [reach], terminal: never}
        states: {S0: search, S1: move, S2: approach}
        initial_state: S0
        transitions:
          - [S0, terminal, always, S1]
          - [S1, terminal, always, S2]
"""
USUAL = {
    "FOUND": "len(seen) > 0",
    "AIMED": "goal is not None and elapsed > 1[s]",
    "HOLD": "x.E.q",
    "GO": "best.x + first.x",
    "REACH": "goal.x",
}
EMPTY, NONE = "`seen` may be empty in state `S1`", "`goal` may be None in state `S2`"


def errors(folder: Path, text: str = SPEC, **texts: str) -> list[str]:
    """Messages about the specification with other texts in some places."""
    for place, usual in USUAL.items():
        text = text.replace(place, texts.get(place, usual), 1)
    path = folder / "spec.yaml"
    path.write_text(text)
    found = compile_spec(str(path)).diagnostics
    return [f"{f.code} {f.message}" for f in found if f.code.startswith("E")]


@pytest.mark.parametrize(
    "texts",
    [
        {},
        {"FOUND": "not (len(seen) == 0)"},
        {"FOUND": "len(seen) >= 2 and elapsed > 1[s]"},
        {"FOUND": "any(o.c > 0.5 for o in seen)"},
        {"FOUND": "not all(o.c < 0.5 for o in seen)"},
        {"FOUND": "any(best.x > o.x for o in seen)"},
        {"FOUND": "elapsed > 1[s]", "GO": "best.x if len(seen) > 0 else 0"},
        {"FOUND": "elapsed > 1[s]", "GO": "0 if len(seen) < 1 else best.x + first.x"},
        {"FOUND": "len(seen) > 0 and best.x > 1[m]"},
        {"AIMED": "elapsed > 1[s]", "REACH": "goal.x if goal is not None else x.E.q"},
        {"AIMED": "elapsed > 1[s]", "REACH": "(best if goal is None else goal).x"},
        {"AIMED": "not (goal is None)"},
        {"AIMED": "NEAR(goal)", "REACH": "best.x"},
        {"REACH": "argmin(abs(o.x - goal.x) for o in seen).x"},
        {"HOLD": "argmax(o.c for o in found).x if len(found) > 0 else 0"},
    ],
    ids=str,
)
def test_what_is_tested_first_is_accepted(texts: dict[str, str], tmp_path: Path) -> None:
    assert errors(tmp_path, **texts) == []


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ({"FOUND": "elapsed > 1[s]"}, EMPTY),
        ({"FOUND": "len(seen) > 0 or elapsed > 1[s]"}, EMPTY),
        ({"FOUND": "len(found) > 0"}, EMPTY),
        ({"FOUND": "all(o.c > 0.5 for o in seen)"}, EMPTY),
        ({"FOUND": "not any(o.c > 0.5 for o in seen)"}, EMPTY),
        ({"FOUND": "best.x > 1[m]"}, "`seen` may be empty in state `S0`, where condition"),
        ({"AIMED": "elapsed > 1[s]"}, NONE),
        ({"AIMED": "goal is None"}, NONE),
        ({"AIMED": "goal is not None or elapsed > 1[s]"}, NONE),
        ({"AIMED": "goal.x > 1[m]"}, "`goal` may be None in state `S1`, where condition"),
        ({"REACH": "argmax(o.c for o in found).x"}, "`found` may be empty in state `S2`"),
        ({"HOLD": "goal.x"}, "`goal` may be None in state `S0`, where function"),
        ({"AIMED": "elapsed > 1[s]", "REACH": "goal.x if elapsed > 1[s] else 0"}, NONE),
    ],
    ids=str,
)
def test_what_is_taken_for_granted_is_refused(
    texts: dict[str, str], message: str, tmp_path: Path
) -> None:
    found = errors(tmp_path, **texts)
    assert found
    assert all(line.startswith("E0705 ") for line in found)
    assert message in found[0]


def test_what_a_behaviour_writes_is_not_known_of_its_next_period(tmp_path: Path) -> None:
    found = errors(tmp_path, text=SPEC.replace("functions: [go]", "functions: [go, look]"))
    assert [EMPTY in message for message in found] == [True, True]


def test_the_clock_of_one_state_says_nothing_of_that_of_the_next(tmp_path: Path) -> None:
    """`elapsed > 1[s]` led to S2, where `elapsed` is zero again."""
    reach = "0 if elapsed > 1[s] else goal.x"
    found = errors(tmp_path, AIMED="elapsed > 1[s]", REACH=reach)
    assert [NONE in message for message in found] == [True]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("BEST([]).x", "E0315 [] is list[Thing]; BEST takes o: nonempty[Thing]"),
        ("None", "E0310 None is not a real[m]"),
        ("x.E.q if x.E.q is None else 0", "E0313 x.E.q is real[m], which is never None"),
        ("0 if goal is 3 else 1[m]", "E0302 is and is not can only test for None"),
        ("argmax(o for o in seen).x", "E0315 o is Thing; items are compared by a number"),
        ("argmax(seen).x", "E0315 argmax goes over a vector or list"),
    ],
)
def test_what_makes_no_sense_is_refused(text: str, message: str, tmp_path: Path) -> None:
    assert message in [line.replace("`", "") for line in errors(tmp_path, HOLD=text)]
