"""`specc status`: the procedure of section 3, step by step."""

import json
from pathlib import Path

import pytest

from specc.cli import main

STAGES = (
    ("specc: 1\nsystem: demo\n", "structure", "open"),
    ("agents:\n  a:\n    title: arm\n", "control", "open"),
    ("    control:\n      title: decides\n", "buffers", "open"),
    ("      x: {b: {n: int}}\n", "role", "open"),
    ("      rate: 10 Hz\n", "fsm", "open"),
    ("      behaviours: {w: {terminal: never}}\n", "fsm", "open"),
    ("      states: {S0: w}\n", "fsm", "open"),
    ("      initial_state: S1\n", "fsm", "open"),
)
OTHER = """\
  b:
    control:
      title: counts
      rate: 10 Hz
      y: {a: {n: int}}
      functions: {count: {y.a.n: 1}}
      behaviours: {w: {functions: [count], terminal: never}}
      states: {S0: w}
      initial_state: S0
"""


def status(path: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, dict[str, str]]:
    """State of each step of each part."""
    assert main(["status", str(path), "--format", "json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["version"] == 1
    return {
        part["of"]: {step["name"]: step["state"] for step in part["steps"]}
        for part in data["parts"]
    }


@pytest.mark.parametrize("count", range(1, len(STAGES) + 1))
def test_the_next_step_is_shown(
    count: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "demo.yaml"
    text = "".join(stage[0] for stage in STAGES[:count])
    path.write_text(text + (OTHER if count > 1 else ""), encoding="utf-8")
    found = status(path, capsys)
    _, step, state = STAGES[count - 1]
    assert state in {steps[step] for steps in found.values() if step in steps}
    if count > 2:
        assert set(found["b.c"].values()) <= {"done"} | ({"open"} if count < 4 else set())


def test_text_says_what_comes_next(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "demo.yaml"
    path.write_text("".join(stage[0] for stage in STAGES[:4]) + OTHER, encoding="utf-8")
    assert main(["status", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == [
        "system  scenario  structure  definitions",
        "demo    open      done       done",
    ]
    table = [line.split() for line in lines if line.startswith(("subsystem", "a.c", "b.c"))]
    assert table[0][1:] == ["buffers", "role", "fsm", "behaviours", "ends"]
    assert table[1] == ["a.c", "done", "open", "open", "open", "open"]
    assert table[2] == ["b.c", "done", "done", "done", "done", "done"]
    assert "  a.c, role: add e.g. `rate: 100 Hz`" in lines


def test_a_part_is_called_by_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = tmp_path / "part.yaml"
    part.write_text("specc: 1\nsubsystem:\n  title: a part\n  rate: 10 Hz\n")
    assert main(["status", str(part)]) == 0
    shown = capsys.readouterr().out
    lines = [line.split() for line in shown.splitlines()]
    assert lines[:2] == [["file", "definitions"], [str(part), "done"]]
    assert ["c", "open", "done", "open", "open", "open"] in lines
    part.write_text("specc: 1\ntypes: {A: reel}\n")
    assert main(["status", str(part)]) == 0
    shown = capsys.readouterr().out
    assert f"{part}  wrong" in shown and f"  {part}, definitions: " in shown


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    assert main(["status", str(tmp_path / "none.yaml")]) == 2


def test_it_is_said_what_is_missing_and_how_much_more(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "demo.yaml"
    operators = "{A: {signature: () -> int}, B: {signature: () -> int}}"
    text = f"specc: 1\nsystem: demo\noperators: {operators}\n"
    path.write_text(text, encoding="utf-8")
    assert main(["status", str(path), "--format", "json"]) == 0
    (whole,) = json.loads(capsys.readouterr().out)["parts"]
    told = {step["name"]: step["next"] for step in whole["steps"]}
    assert told["definitions"].startswith("operator `A` has no Python function yet: add `python:")
    assert told["definitions"].endswith(" (and 1 more)")
    assert told["structure"] == "add `agents:`"


def test_a_plant_brings_a_step(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "demo.yaml"
    task = "task: {cycle: {of: a.c, from: S0, to: S0}}\n"
    path.write_text("".join(stage[0] for stage in STAGES[:-1]) + OTHER + task, encoding="utf-8")
    assert status(path, capsys)["demo"]["simulation"] in {"done", "open"}
    path.write_text("".join(stage[0] for stage in STAGES[:-1]) + OTHER, encoding="utf-8")
    assert "simulation" not in status(path, capsys)["demo"]


def test_it_counts_what_is_required(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "demo.yaml"
    required = 'require: [{that: "always(state(b.c) == S0)", because: it counts}]\n'
    path.write_text("".join(s[0] for s in STAGES[:-1]) + OTHER + required, encoding="utf-8")
    assert main(["status", str(path), "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)["requirements"]
    assert told == [{"that": "always(state(b.c) == S0)", "because": "it counts"}]
    assert main(["status", str(path)]) == 0
    assert "1 requirement is watched in every run\n" in capsys.readouterr().out
