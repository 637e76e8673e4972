"""`specc report`: what it writes, what it says of files that are damaged or none, exit codes."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from tests.commands import ROOT, specc
from tests.page.recordings import KEPT, forged_run
from tests.recording.bombs import bombs
from tests.recording.forged import forged
from tests.recording.runs import CONVEYOR
from tests.recording.test_damage import _damaged_at
from tests.report.test_results import RUN, SCENARIO, _written
from tests.seeds import short

pytestmark = pytest.mark.no_replay("damaged, or of strangers")


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A recording with three steps and a fault."""
    steps: list[Mapping[str, Any]] = [
        {"state": "going"},
        {"before": "going", "state": "gone"},
        {"state": "gone"},
    ]
    report = {"faults": [{"culprit": "a.c", "message": "it broke", "time_s": 0.1}]}
    return forged_run(tmp_path / "small.mcap", {}, {"a.c": steps}, report=report, seed="7")


def data_of(file: Path, name: str) -> Any:
    """The data of that name in a report."""
    text = file.read_text(encoding="utf-8")
    found = re.search(f'<script type="application/json" id="{name}">(.*?)</script>', text)
    return json.loads(found[1]) if found else None


def test_the_same_recording_makes_the_same_bytes(small: Path, tmp_path: Path) -> None:
    assert specc("report", small.name, cwd=tmp_path).stdout == "small-report.html\n"
    first = (tmp_path / "small-report.html").read_bytes()
    assert first.startswith(b"<!doctype html>\n<!-- specc report -->\n")
    assert specc("report", small.name, cwd=tmp_path).returncode == 0, "its own file is replaced"
    assert (tmp_path / "small-report.html").read_bytes() == first
    assert str(tmp_path).encode() not in first
    (facts,) = data_of(tmp_path / "small-report.html", "about")["facts"]
    said = {"result": "1 fault", "seed": "7", "first failure": "0.1 s fault: a.c: it broke"}
    assert said.items() <= dict(facts).items()


@pytest.mark.long  # processes of their own
def test_bytes_depend_on_nothing_else(tmp_path: Path) -> None:
    made = set()
    for seed, zone in (("1", "UTC"), ("2", "Asia/Tokyo")):
        command = [sys.executable, "-m", "specc", "report", str(KEPT), "--out", f"{seed}.html"]
        path = os.pathsep.join([str(ROOT), str(ROOT / "runtime")])
        more = {"PYTHONHASHSEED": seed, "TZ": zone, "LC_ALL": "C", "PYTHONPATH": path}
        subprocess.run(command, cwd=tmp_path, env={**os.environ, **more}, check=True)
        made.add((tmp_path / f"{seed}.html").read_bytes())
    assert len(made) == 1


def test_other_files_are_replaced_by_force_only(small: Path, tmp_path: Path) -> None:
    out = tmp_path / "own.html"
    out.write_text("<!doctype html>\nby hand")
    done = specc("report", small, "--out", out)
    assert done.returncode == 2 and "--force" in done.stderr
    assert out.read_text() == "<!doctype html>\nby hand"
    assert specc("report", small, "--out", out, "--force").returncode == 0
    assert specc("report", small, "--out", tmp_path / "own.txt").returncode == 2
    assert specc("report", small, "--out", small).returncode == 2
    assert small.read_bytes().startswith(b"\x89MCAP")


@pytest.mark.long  # recordings of whole runs
def test_what_is_lost_is_said_and_is_code_3(tmp_path: Path) -> None:
    (tmp_path / "cut.mcap").write_bytes(KEPT.read_bytes()[:60_000])
    _damaged_at(2.3, tmp_path / "damaged.mcap")
    for name, words in (("cut", "was cut after"), ("damaged", "is damaged: one part")):
        out = tmp_path / f"{name}.html"
        done = specc("report", tmp_path / f"{name}.mcap", "--out", out)
        assert done.returncode == 3 and name in done.stderr
        assert any(words in notice for notice in data_of(out, "run-0")["hello"]["notice"])


def test_a_signal_that_no_recording_has_is_refused(small: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.html"
    texts = {"gate.yaml": CONVEYOR.read_text(encoding="utf-8")}
    gate = forged_run(tmp_path / "gate.mcap", texts, {"gate.c": [{"state": "closed"}]})
    done = specc("report", gate, small, "--signal", "gate.c.x.belt.w", "--out", out)
    assert done.returncode == 2 and "did you mean `gate.c.x.belt.v`" in done.stderr
    assert not out.exists()


def test_what_cannot_be_read_is_refused_or_named(small: Path, tmp_path: Path) -> None:
    out, gone = tmp_path / "out.html", tmp_path / "gone.mcap"
    (tmp_path / "no.mcap").write_text("no recording")
    empty = forged(tmp_path / "empty.mcap", {})
    for bad in (gone, tmp_path / "no.mcap"):
        done = specc("report", bad, "--out", out)
        assert done.returncode == 2 and "Traceback" not in done.stderr
        assert not out.exists()
    assert specc("report", empty, "--out", out).returncode in (0, 2)
    done = specc("report", gone, small, "--out", out, "--force")
    assert done.returncode == 3
    (shown,) = data_of(out, "about")["tables"]
    assert [row["cells"][0] for row in shown["rows"]] == ["small.mcap"]
    assert "gone.mcap" in shown["notes"][0]


def test_without_the_specification_that_is_asked_for_nothing_is_written(
    small: Path, tmp_path: Path
) -> None:
    """Whatever is wrong with recordings before."""
    out, broken = tmp_path / "out.html", tmp_path / "broken.yaml"
    broken.write_text("specc: 1\n")
    for spec, code in ((tmp_path / "none.yaml", 2), (broken, 1)):
        done = specc("report", tmp_path / "no.mcap", small, "--spec", spec, "--out", out)
        assert done.returncode == code and "error[" in done.stderr and not out.exists()


def test_results_lead_to_the_sections_of_their_recordings(small: Path, tmp_path: Path) -> None:
    runs = [
        {**RUN, "passed": False, "recording": "small.mcap"},
        {**RUN, "seed": 1, "passed": False, "recording": "gone.mcap"},
    ]
    file = _written(tmp_path, {**SCENARIO, "runs": runs})
    out = tmp_path / "out.html"
    done = specc("report", file, "--out", out)
    assert done.returncode == 3 and "gone.mcap" in done.stderr
    _, rows, lost = data_of(out, "about")["tables"]
    assert [row["run"] for row in rows["rows"]] == [0, None]
    assert "gone.mcap" in lost["notes"][0]
    assert data_of(out, "run-0")["hello"]["file"] == "small.mcap"


@pytest.mark.long
def test_it_says_how_the_specification_is_named(tmp_path: Path) -> None:
    """With the words of the command, as the recordings of results are not named in it."""
    run = specc("run", ROOT / "specs/examples/tray_cell.yaml", "--duration", 0.1, "--record",
                tmp_path / "stop-1.mcap")  # fmt: skip
    assert run.returncode == 0, run.stderr
    results, out = _written(tmp_path / "results", SCENARIO), tmp_path / "out.html"
    (tmp_path / "stop-1.mcap").rename(results.parent / "stop-1.mcap")
    assert specc("report", results.parent, "--out", out).returncode == 3, "one is missing"
    assert "specc report results --spec" in out.read_text(encoding="utf-8")


def test_tables_need_no_recording(tmp_path: Path) -> None:
    file = _written(tmp_path, {**SCENARIO, "runs": [RUN]})
    out = tmp_path / "out.html"
    assert specc("report", file, "--out", out).returncode == 0
    assert len(data_of(out, "about")["tables"]) == 2 and data_of(out, "run-0") is None


@pytest.mark.parametrize("bomb", short([name for name, _ in bombs()][::7], 0, 1))
def test_bombs_are_refused_or_small(bomb: str, tmp_path: Path) -> None:
    (tmp_path / "bomb.mcap").write_bytes(dict(bombs())[bomb]())
    out = tmp_path / "out.html"
    done = specc("report", tmp_path / "bomb.mcap", "--out", out)
    assert done.returncode in (0, 2, 3) and "Traceback" not in done.stderr
    assert not out.exists() or out.stat().st_size < 16_000_000
