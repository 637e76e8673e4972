"""Who looks at a run, and stops it now and then, changes nothing of it."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import pytest
from specc_runtime import main

from tests.commands import ROOT
from tests.page.fake_server import Code, shown, written
from tests.recording.runs import messages, report_of

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

SPECS = {
    "conveyor_gate": "conveyor_gate.yaml",
    "three_tier": "architectures/three_tier.yaml",
    "syndicate": "architectures/syndicate.yaml",
}


def files(folder: Path) -> dict[str, Any]:
    folder.mkdir()
    return {"record": folder / "run.mcap", "report": folder / "report.json", "duration_s": 6.0}


def content(folder: Path) -> Any:
    found = messages(folder / "run.mcap")
    return {topic: [(m.log_time, data) for m, data in each] for topic, each in found.items()}


@pytest.mark.parametrize("name", SPECS)
def test_records_recordings_and_reports_are_the_same(name: str, tmp_path: Path) -> None:
    code = written(ROOT / "specs" / SPECS[name], tmp_path / "code")
    assert main.run(code.options(**files(tmp_path / "alone"))) in (0, 1)
    expected = report_of(tmp_path / "alone/report.json"), content(tmp_path / "alone")
    machine = next(iter(expected[1]["/snapshot"][0][1]["stamps"]))
    stops = [{"kind": "state", "machine": m, "state": s}
             for topic, each in expected[1].items() if "state" in each[0][1]
             for m in [topic[1:]] for s in {data["state"] for _, data in each}]  # fmt: skip
    with shown(code, **files(tmp_path / "page")) as run:
        run.thread.join()
    with shown(code, is_deaf=True, **files(tmp_path / "deaf")) as run:
        run.thread.join()
    with shown(code, {"do": "break", "breakpoints": stops}, **files(tmp_path / "stops")) as run:
        server, seen = run.server, 0
        until_s = time.monotonic() + 60
        while run.thread.is_alive() and time.monotonic() < until_s:
            stopped = len(server.of("stopped"))
            if stopped > seen or run.page.control.is_paused:
                seen = stopped
                server.send("step", machine=machine) if stopped % 3 == 0 else server.send(
                    "continue"
                )
                server.send("speed", value=50.0 if stopped % 2 else None)
            time.sleep(0.01)
        assert seen > 2
    for how in ("page", "deaf", "stops"):
        report = report_of(tmp_path / how / "report.json")
        assert report["records_sha256"] == expected[0]["records_sha256"], how
        assert report == expected[0], how
        assert content(tmp_path / how) == expected[1], how


def test_a_page_is_no_part_of_a_report(gate: Code, tmp_path: Path) -> None:
    with shown(gate, **files(tmp_path / "a")) as run:
        run.thread.join()
    assert "page" not in json.loads((tmp_path / "a/report.json").read_text())
