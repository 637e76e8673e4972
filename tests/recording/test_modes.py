"""What runs of a machine with modes tell: modes, causes with names, and the way back."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from specc_runtime.faults import UndecidedTransition

from specc.cli.recordings import call_runtime
from specc.pipeline import read_spec
from specc.tools.plot.sheet import PlottedRun, bands
from tests.commands import ROOT, specc

SPEC = ROOT / "tests/tools/modes.yaml"
RUN = "arm.mcap"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("modes")
    (folder / "arm.yaml").write_text(SPEC.read_text(encoding="utf-8"), encoding="utf-8")
    asked = ("--duration", "12", "--record", RUN, "--report", "arm.json")
    done = specc("run", "arm.yaml", *asked, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def why(recorded: Path, moment: float, *more: str) -> str:
    done = specc("why", f"{RUN}@{moment}", *more, "--spec", "arm.yaml", cwd=recorded)
    assert not done.stderr
    return done.stdout


def test_a_state_has_its_modes(recorded: Path) -> None:
    assert "arm.c   grasping in picking in working in powered" in why(recorded, 3)
    assert "in paused in powered since 4.2 s" in why(recorded, 4.35, "arm.c")


def test_a_cause_has_its_name_and_its_mode(recorded: Path) -> None:
    told = why(recorded, 4.2, "arm.c")
    assert "  by carrying error pause always -> paused  (arm.yaml:" in told
    assert "  conditions of carrying in placing in working in powered:\n" in told
    assert "    error tripped of mode powered: False" in told
    assert "    error tired of mode working: False" in told
    assert "      elapsed(working) = 2.55 s, needs > 60 s" in told
    assert "periods(" not in told
    assert "    error pause of mode working: True" in told
    assert "    error slow: not asked, for error pause of mode working occurred" in told
    assert "rows of error tired: not asked, for error tired did not occur: always" in told


def test_a_row_that_resumes_says_so(recorded: Path) -> None:
    told = why(recorded, 4.5, "arm.c")
    assert "  by paused terminal always -> carrying by resume(working)  (arm.yaml:" in told
    assert "      left(working) = carrying, is == carrying\n" in told
    assert "-> looking by resume" not in told
    later = why(recorded, 4.4, "arm.c")
    assert "rows of terminal: not asked, for terminal did not occur: always -> resume(w" in later


def test_the_report_has_the_time_in_modes(recorded: Path) -> None:
    report = json.loads((recorded / "arm.json").read_text(encoding="utf-8"))
    arm, desk = (report["subsystems"][name] for name in ("arm.c", "desk.c"))
    assert arm["time_in_modes_s"]["powered"] == pytest.approx(
        sum(arm["time_in_states_s"].values()) - arm["time_in_states_s"].get("failed", 0)
    )
    assert arm["time_in_modes_s"]["working"] < arm["time_in_modes_s"]["powered"]
    assert "time_in_modes_s" not in desk
    assert "carrying error pause always -> paused" in arm["transitions_taken"]


def test_the_timeline_has_a_band_for_each_level_of_modes(recorded: Path) -> None:
    file = recorded / RUN
    reading = call_runtime("recording.reading", "RecordFile", file)
    traces = call_runtime("recording.traces", "traces", file, {}, reading)
    system = read_spec(str(SPEC)).system
    found = list(bands([PlottedRun("", traces)], ["arm.c"], system))
    assert [band.label for band in found] == ["arm.c modes", "", "", "arm.c"]
    assert [span[2] for span in found[0].spans][:1] == ["powered"]
    assert {span[2] for span in found[2].spans} <= {"picking", "placing"}


def test_a_fault_names_state_modes_and_cause() -> None:
    fault = UndecidedTransition("arm.c", "lifting", "tired", [], {})
    fault.modes = ("working", "powered")
    words = "arm.c in lifting in working in powered: error condition tired holds; "
    assert str(fault) == f"{words}none of its rows applies"
    assert fault.as_data()["modes"] == ["working", "powered"]
    assert "modes" not in UndecidedTransition("arm.c", "idle", "error", [], {}).as_data()
