"""Recordings have the ages that steps were told, and runs go on with the times of measurement."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.recording.runs import messages, report_of, specc
from tests.runtime.test_ages import text_of


def recorded(folder: Path) -> tuple[Path, Path]:
    """A specification and a recording of a run of it."""
    spec, file = folder / "watched.yaml", folder / "run.mcap"
    spec.write_text(text_of())
    done = specc("run", spec, "--duration", 0.5, "--record", file, "--report", folder / "a.json")
    assert done.returncode == 0, done.stderr
    return spec, file


def test_ages_are_recorded_and_replayed(tmp_path: Path) -> None:
    spec, file = recorded(tmp_path)
    steps = [data for _, data in messages(file)["/arm.c"]]
    assert [step["age"] for step in steps[9:11]] == [{"cam.d": 0.09}, {"cam.d": 0.05}]
    assert {step["late"]["cam.d"] for step in steps} == {0}
    assert not any("age" in data or "late" in data for _, data in messages(file)["/arm.cam"])
    replayed = specc("replay", file, "--spec", spec)
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr


def test_a_run_that_ended_with_something_too_old_is_replayed(tmp_path: Path) -> None:
    spec, file = tmp_path / "watched.yaml", tmp_path / "run.mcap"
    spec.write_text(text_of(limit="120 ms").replace(":Cam", ":Still"))
    done = specc("run", spec, "--duration", 0.5, "--record", file, "--report", tmp_path / "a.json")
    assert done.returncode == 1
    (fault,) = report_of(tmp_path / "a.json")["faults"]
    assert (fault["fault"], fault["culprit"]) == ("TooOld", "subsystem arm.cam")
    replayed = specc("replay", file, "--spec", spec)
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr
    assert "arm.c: 14 steps are the same" in replayed.stdout


def test_why_tells_ages(tmp_path: Path) -> None:
    spec, file = recorded(tmp_path)
    told = specc("why", f"{file}@0.2", "arm.c", "--spec", spec)
    assert "age(x.cam.d) = 0.05" in told.stdout, told.stdout + told.stderr


@pytest.mark.long
def test_a_run_that_goes_on_knows_when_things_were_measured(tmp_path: Path) -> None:
    spec, file = recorded(tmp_path)
    again = tmp_path / "again.mcap"
    for at in (0.08, 0.2, 0.33):
        done = specc(
            *("run", spec, "--duration", 0.5, "--report", tmp_path / "b.json"),
            *("--from", f"{file}@{at}", "--record", again),
        )
        assert done.returncode == 0, done.stderr
        steps = {data["stamp"]: data for _, data in messages(file)["/arm.c"]}
        later = [data for _, data in messages(again)["/arm.c"]]
        assert later
        assert all(steps[data["stamp"]] == data for data in later)
        assert report_of(tmp_path / "b.json")["faults"] == []
