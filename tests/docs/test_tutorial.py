"""The tutorial's pieces are the tutorial's specification, and its commands answer as it shows."""

import json
import re
from pathlib import Path

import pytest

from specc.cli import main
from tests.docs.test_two_gates import changed
from tests.docs.tutorial import ROOT, Step, answer, pieces, steps

SPEC = ROOT / "specs" / "conveyor_gate.yaml"
STEPS = list(steps())
MEASURED = re.compile(r" *[\d.]+ us|(?<=simulated in ).*|(?<=records ).*")
"""What differs from machine to machine."""


def test_the_pieces_together_are_the_specification() -> None:
    spec = SPEC.read_text(encoding="utf-8")
    assert "".join(pieces("yaml")).strip() == spec[spec.index("specc: 1") :].strip()


@pytest.mark.parametrize("step", STEPS, ids=range(len(STEPS)))
def test_validate_says_what_the_tutorial_shows(step: Step) -> None:
    assert answer(step) == step.shown, "python -m tests.docs.tutorial shows the present answers"


def test_what_the_mistakes_lead_to() -> None:
    first_words = [step.shown.partition(":")[0] for step in STEPS]
    assert first_words == ["open[O0402]", "1 file checked", "error[E0601]", "error[E0602]"]


def test_the_last_change_fits() -> None:
    (difference,) = pieces("diff")
    text = changed("".join(pieces("yaml")), difference)
    assert answer(Step(text, "", (0, 0))) == "1 file checked: 0 errors, 0 warnings\n"


def test_shown_code_is_generated(tmp_path: Path) -> None:
    assert main(["build", str(SPEC), "--out", str(tmp_path)]) == 0
    text = (tmp_path / "conveyor_gate" / "belt_c.py").read_text(encoding="utf-8")
    shown = pieces("python")
    assert shown
    assert all(piece in text for piece in shown)


def test_parcels_pass_without_faults(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gate.json"
    assert main(["run", str(SPEC), "--duration", "20", "--report", str(path)]) == 0
    told = [MEASURED.sub("", line) for line in capsys.readouterr().out.splitlines()]
    (shown,) = pieces("text")
    assert [MEASURED.sub("", line) for line in shown.splitlines()] == told
    report = json.loads(path.read_text(encoding="utf-8"))
    assert report["faults"] == []
    assert [cycle["ended"] for cycle in report["cycles"]] == ["completed"] * 3
    visited = report["subsystems"]["gate.c"]["states_visited"]
    assert set(visited) == {"closed", "halting", "opening", "passing", "closing"}
    assert "alarm" not in report["subsystems"]["belt.c"]["states_visited"]
