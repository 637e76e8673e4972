"""Behaviours and functions with parameters, in the editor."""

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import apply
from tests.seeds import every
from tests.tools.lsp.workspace import edited, place

LIFT = """\
specc: 1.2
system: lift
constants: {slow: "0.1[m/s]", low: "0.2[m]", high: "1[m]"}
agents:
  a:
    real_effectors: {m: {x: {v: {type: "real[m/s]", safe: 0}}, y: {p: "real[m]"}}}
    virtual_effectors: {m: {rate: 10 Hz, through: identity}}
    control:
      rate: 10 Hz
      x: {m: {p: {type: "real[m]", init: 0}}}
      y: {m: {v: "real[m/s]"}}
      functions:
        drive: {signature: "(by: real[m/s], goal: real[m])", y.m.v: "by if goal > x.m.p else -by"}
      behaviours:
        go:
          signature: "(to: real[m], speed: real[m/s])"
          functions: ["drive(goal: to, by: 2 * speed)"]
          terminal: {when: "near(x.m.p, to, 0.01[m])"}
      states:
        up: "go(to: high, speed: slow)"
        down: go(low, slow)
      initial_state: up
      transitions:
        - [up, terminal, always, down]
        - [down, terminal, always, up]
"""


@pytest.fixture
def lift(tmp_path: Path) -> tuple[Project, str]:
    return edited(tmp_path / "lift.yaml", LIFT)


@pytest.mark.parametrize(
    ("marked", "old", "new", "times"),
    every(
        3,
        [
            ('"(|to: real[m]', "to", "target", 4),
            ('"go(|to: high', "to", "target", 4),
            ("goal: |to, by", "to", "target", 4),
            ("near(x.m.p, |to,", "to", "target", 4),
            ("2 * |speed", "speed", "pace", 3),
            ('"|drive(goal', "drive", "move", 2),
            ("down: |go(", "go", "walk", 3),
            ("down: go(|low", "low", "bottom", 2),
            ("speed: |slow)", "slow", "lazy", 3),
            ("        |up: ", "up", "rising", 4),
        ],
    ),
)
def test_rename(lift: tuple[Project, str], marked: str, old: str, new: str, times: int) -> None:
    project, path = lift
    edits = features.rename_at(project, path, place(LIFT, marked), new)
    assert len(edits) == times
    text = apply(LIFT, edits)
    project.put(path, text)
    project.analyse(path)
    again = features.rename_at(
        project, path, place(text, marked.replace(f"|{old}", f"|{new}")), old
    )
    assert apply(text, again) == LIFT


@pytest.mark.parametrize(
    ("old", "typed", "there"),
    [
        ('"go(to: high, speed: slow)"', '"go(|)"', {"to: ", "speed: ", "high", "slow", "x"}),
        ('"go(to: high, speed: slow)"', "|", {"go"}),
        ('"drive(goal: to, by: 2 * speed)"', '"drive(goal: |', {"by: ", "to", "high"}),
        ('"(to: real[m], speed: real[m/s])"', '"(to: |', {"real", "pose"}),
    ],
)
def test_completion(lift: tuple[Project, str], old: str, typed: str, there: set[str]) -> None:
    project, path = lift
    before, after = typed.split("|")
    start = LIFT.index(old)
    project.put(path, LIFT[:start] + before + after + LIFT[start + len(old) :])
    project.analyse(path)
    found = features.completions(project, path, start + len(before))
    assert there <= {completion.label for completion in found}


def test_the_call_that_is_being_written(lift: tuple[Project, str]) -> None:
    project, path = lift
    label = "go(to: real[m], speed: real[m/s])"
    for marked, active in [("go(low|, slow)", 0), ("go(low, |slow)", 1)]:
        found = features.signature_at(project, path, place(LIFT, marked))
        assert found is not None
        assert (found.label, found.active) == (label, active)


def test_hover(lift: tuple[Project, str]) -> None:
    project, path = lift
    for marked, words in [
        ("2 * |speed", "real[m/s]"),
        ("down: go(|low", "real[m]"),
        ("down: |go(", "behaviour"),
        ("        |up: ", "state"),
    ]:
        hover = features.hover(project, path, place(LIFT, marked))
        assert hover is not None
        assert words in str(hover), (marked, hover)
