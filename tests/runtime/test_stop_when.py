"""`--stop-when` ends a run once a formula holds, and says when that was."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.commands import ROOT, specc
from tests.recording.runs import messages, report_of
from tests.seeds import every

GATE = ROOT / "specs/conveyor_gate.yaml"
PASSING = "state(gate.c) == passing"


def ran(folder: Path, formula: str, *options: object, code: int = 0) -> tuple[dict[str, Any], str]:
    """The report of at most six seconds, and standard error."""
    report = folder / "report.json"
    limits = () if {"--duration", "--cycles"} & {*options} else ("--duration", 6)
    given = ("--stop-when", formula, "--report", report, *limits, *options)
    done = specc("run", GATE, *given)
    assert done.returncode == code, done.stdout + done.stderr
    return json.loads(report.read_text()), done.stdout + done.stderr


@pytest.mark.parametrize(
    ("formula", "subsystem", "lasted"),
    every(2, [(PASSING, "gate.c", 0), (f"historically(0.5[s], {PASSING})", "gate.c", 10)]),
)
def test_it_is_met_where_the_recording_has_it(
    tmp_path: Path, formula: str, subsystem: str, lasted: int
) -> None:
    file = tmp_path / "run.mcap"
    report, told = ran(tmp_path, formula, "--record", file)
    steps = [data for _, data in messages(file)[f"/{subsystem}"]]
    first = next(i for i, step in enumerate(steps) if step["state"] == "passing")
    met_s = steps[first + lasted]["time"]
    assert report["stop_when"] == {"that": formula, "met_s": pytest.approx(met_s)}
    assert report["ended"] == "completed"
    assert f"held first at {met_s:.3f} s: {formula}" in told
    # Known to others one period later, where the run ends; nothing of it is missing.
    assert report["simulated_s"] == pytest.approx(met_s + 0.06, abs=0.011)
    assert len(steps) == first + lasted + 2
    done = specc("replay", file, "--spec", GATE)
    assert (done.returncode, "differs" in done.stdout) == (0, False)


@pytest.mark.long
def test_the_run_until_then_is_that_without_the_formula(tmp_path: Path) -> None:
    ran(tmp_path, PASSING, "--record", tmp_path / "a.mcap")
    whole = specc("run", GATE, "--duration", 6, "--record", tmp_path / "b.mcap")
    assert whole.returncode == 0
    stopped, steps = messages(tmp_path / "a.mcap")["/gate.c"], messages(tmp_path / "b.mcap")
    assert [d for _, d in stopped] == [d for _, d in steps["/gate.c"][: len(stopped)]]


def test_it_is_never_met(tmp_path: Path) -> None:
    report, told = ran(tmp_path, "belt.drive.v_p > 2[rad/s]", code=1)
    assert report["stop_when"]["met_s"] is None
    assert report["simulated_s"] == pytest.approx(6)
    assert "never held: belt.drive.v_p > 2[rad/s]" in told
    assert "not fulfilled: within 6 s this never held" in told


def test_it_counts_instead_of_the_cycles_that_are_missing(tmp_path: Path) -> None:
    report, _ = ran(tmp_path, PASSING, "--cycles", 3)
    assert report["cycles"] == []
    report, _ = ran(tmp_path, "belt.drive.v_p > 2[rad/s]", "--cycles", 1, code=1)
    assert len(report["cycles"]) == 1


def test_what_comes_true_in_the_last_period_is_met(tmp_path: Path) -> None:
    report, _ = ran(tmp_path, PASSING, "--duration", 2.71)
    assert report["stop_when"]["met_s"] == pytest.approx(2.7)
    assert report["simulated_s"] == pytest.approx(2.71)


def test_a_violated_requirement_wins(tmp_path: Path) -> None:
    settings = ("--set", "cruise=1[rad/s]", "--set", "patience=2[s]", "--duration", 20)
    formula = "state(gate.c) == opening and belt.E.drive.v_m >= 0.1[rad/s]"
    report, _ = ran(tmp_path, formula, *settings, code=1)
    assert report["stop_when"]["met_s"] is not None
    assert report["requirements"][0]["verdict"] == "violated"


@pytest.mark.parametrize(
    ("formula", "code", "at", "way"),
    every(
        3,
        [
            ("state(gate.c) == pasing", "O0205", "1:18", "`passing`"),
            ("state(gat.c) == passing", "E0201", "1:7", "did you mean `gate.c`"),
            ("belt.drive.v_p > 0.1[m]", "E0311", "1:1", "same unit"),
            ("belt.drive.v_p >", "E0301", "1:16", "missing at the end"),
            (f"always({PASSING})", "E0335", "1:1", "leave out `always`"),
            (f"within(1[s], {PASSING})", "E0335", "1:1", "`once`, `historically` or `since`"),
        ],
    ),
)
def test_a_wrong_formula_is_refused_with_its_place(
    tmp_path: Path, formula: str, code: str, at: str, way: str
) -> None:
    report = tmp_path / "report.json"
    done = specc("run", GATE, "--stop-when", formula, "--report", report)
    assert done.returncode == 2
    assert f"[{code}]" in done.stderr
    assert f"--> --stop-when:{at}\n" in done.stderr
    assert way in done.stderr
    assert not report.exists()


def test_an_empty_formula_is_refused() -> None:
    done = specc("run", GATE, "--stop-when", " ")
    assert (done.returncode, "--stop-when: the formula is empty" in done.stderr) == (2, True)


@pytest.mark.long
def test_a_run_goes_on_from_one_that_was_stopped(tmp_path: Path) -> None:
    """As one that never was; and a formula that held before the moment does not end it."""
    file = tmp_path / "run.mcap"
    ran(tmp_path, PASSING, "--record", file)
    again = tmp_path / "again.json"
    going_on = specc("run", GATE, "--from", f"{file}@2", "--duration", 6, "--report", again)
    assert (going_on.returncode, going_on.stderr.count("--from:")) == (0, 0)
    whole = tmp_path / "whole.json"
    assert specc("run", GATE, "--duration", 6, "--report", whole).returncode == 0
    assert report_of(again) == report_of(whole)
    report, _ = ran(tmp_path, "state(gate.c) == opening", "--from", f"{file}@2")
    assert report["stop_when"]["met_s"] == pytest.approx(2.25)
    for other in ((), ("--set", "cruise=0.5[rad/s]")):
        report, _ = ran(tmp_path, "state(gate.c) == opening", "--from", f"{file}@2.3", *other)
        assert report["stop_when"]["met_s"] == pytest.approx(2.3)


@pytest.mark.long
def test_a_sweep_stops_its_runs(tmp_path: Path) -> None:
    asked = ("sweep", GATE, "--seeds", "0:1", "--duration", 6, "--out", tmp_path / "s")
    done = specc(*asked, "--stop-when", PASSING)
    assert done.returncode == 0, done.stderr
    header, row = (tmp_path / "s/runs.csv").read_text().splitlines()
    told = dict(zip(header.split(","), row.split(","), strict=False))
    assert float(told["met_s"]) == pytest.approx(2.7)
    assert told["success"] == "true"
    other = specc(*asked, "--stop-when", "belt.drive.v_p > 2[rad/s]")
    assert "has runs with another stop_when" in other.stderr
    asked = (*asked[:4], "--duration", "2.0000001", "--out", tmp_path / "n")
    never = specc(*asked, "--stop-when", "belt.drive.v_p > 2.0[rad/s]")
    assert "1 not successful: never held: belt.drive.v_p > 2.0[rad/s]" in never.stdout
    again = "--duration 2.0000001 --stop-when 'belt.drive.v_p > 2.0[rad/s]' --seed 0"
    assert again in never.stdout
