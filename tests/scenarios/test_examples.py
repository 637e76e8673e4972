"""The examples: short, valid, explored, and successful with every seed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from specc.cli.main import main
from tests.scenarios.runs import INSTALLED, SPECS
from tests.seeds import SOAK
from tests.sweep.runs import swept, table

CELL, SKILL = (SPECS / "examples" / f"{name}.yaml" for name in ("tray_cell", "pick_cubes"))
WHEELS = sorted(set((SPECS / "examples").glob("*.yaml")) - {CELL})
"""Those of robots from wheels."""
LIMIT_S = 60
FROM_WHEELS = [pytest.param(spec, marks=INSTALLED, id=spec.stem) for spec in WHEELS]
ALL = [*FROM_WHEELS, pytest.param(CELL, id=CELL.stem)]
EACH = pytest.mark.parametrize("spec", ALL)
ALONE = [each for each in ALL if SKILL not in each.values]
"""Those that nobody in ROS commands."""


@pytest.mark.parametrize(
    ("spec", "lines"), [*((spec, 199) for spec in WHEELS), (CELL, 235)], ids=str
)
def test_it_is_short(spec: Path, lines: int) -> None:
    """The system; what it is tried with comes after it."""
    system, _, _ = spec.read_text(encoding="utf-8").partition("\nscenarios:\n")
    assert len(system.splitlines()) <= lines


@pytest.mark.parametrize("spec", WHEELS, ids=lambda spec: spec.stem)
def test_the_line_that_an_error_shows_without_the_wheels_says_how_to_get_them(spec: Path) -> None:
    lines = spec.read_text(encoding="utf-8").splitlines()
    (line,) = (each for each in lines if each.startswith("  model: "))
    assert line.endswith("make models")


@EACH
def test_it_is_valid(spec: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", "--strict", str(spec)]) == 0
    assert "0 errors, 0 warnings" in capsys.readouterr().err


@pytest.mark.parametrize("spec", FROM_WHEELS)
@pytest.mark.long
def test_nothing_is_found_in_all_that_it_can_do(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explore", str(spec), "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["status"], told["findings"]) == ("complete", [])


@pytest.mark.long
def test_nothing_is_found_in_the_cell_up_to_the_bound(capsys: pytest.CaptureFixture[str]) -> None:
    """Timers of its modes count too far for all of it."""
    assert main(["explore", str(CELL), "--budget", "200000", "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["status"], told["findings"]) == ("ended at the bound", [])


@pytest.mark.parametrize("spec", ALONE)
@pytest.mark.parametrize(
    "count", [pytest.param(4, marks=pytest.mark.long), pytest.param(10, marks=SOAK)]
)
def test_every_seed_succeeds(spec: Path, count: int, tmp_path: Path) -> None:
    options = ("--seeds", f"0:{count}", "--cycles", "1", "--cycle-limit", str(LIMIT_S))
    done = swept(tmp_path, spec, "--workers", "2", *options)
    assert done.returncode == 0, done.stderr
    rows = table(tmp_path)
    assert len(rows) == count
    assert [(row["seed"], row["reason"]) for row in rows if row["success"] != "true"] == []
