"""The scenarios of shipped cells: they pass, and their runs are those of `specc run`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.commands import specc
from tests.scenarios.runs import INSTALLED, SPECS
from tests.tools.scenarios.belt import single

CELLS = {
    "conveyor_gate": "barrier_stuck",
    "rovers": "to_and_fro",
    "architectures/three_tier": "open_doors",
    "architectures/teleoperation": "let_go",
    "examples/tray_cell": "stopped_while_carrying",
    "examples/panda_bin": "barely_moved",
}
"""Each with a scenario that is short."""
EACH = [
    pytest.param(cell, marks=INSTALLED if "panda" in cell else ()) for cell in CELLS
]  # of a wheel


def results_of_passing(folder: Path, spec: Path, *arguments: object) -> dict[str, Any]:
    """The results, by names, of scenarios that pass."""
    out = folder / "results"
    done = specc("test", spec, "--budget", 0, "--out", out, *arguments, cwd=SPECS.parent)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads((out / "results.json").read_text())
    return {entry["name"]: entry for entry in found["scenarios"]}


@pytest.mark.long
@pytest.mark.parametrize("cell", EACH)
def test_results_are_those_of_single_runs(cell: str, tmp_path: Path) -> None:
    spec, name = SPECS / f"{cell}.yaml", CELLS[cell]
    for run in results_of_passing(tmp_path, spec, "-k", name, "--jobs", 2)[name]["runs"]:
        report = single(tmp_path, run["seed"], spec, "--scenario", name)
        assert run["records_sha256"] == report["records_sha256"]
        assert not any(each["verdict"] == "violated" for each in report["requirements"])


@pytest.mark.long
@pytest.mark.soak
@pytest.mark.parametrize("cell", EACH)
def test_every_scenario_passes(cell: str, tmp_path: Path) -> None:
    assert len(results_of_passing(tmp_path, SPECS / f"{cell}.yaml")) >= 2
