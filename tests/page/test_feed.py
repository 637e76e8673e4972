"""What a page sees of a run is what a recording has of it."""

from __future__ import annotations

import json
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from specc_runtime import main
from specc_runtime.page.link import Content, Link
from specc_runtime.recording.index import Index
from specc_runtime.recording.moment import seen_at

from tests.commands import ROOT
from tests.page.fake_server import Code, shown, written
from tests.recording.runs import messages, report_of
from tests.recording.test_real_time import on_the
from tests.runtime.driven import DrivenClock
from tests.seeds import short

RUNS = {
    "conveyor_gate": (ROOT / "specs/conveyor_gate.yaml", 3.0),
    "three_tier": (ROOT / "specs/architectures/three_tier.yaml", 4.0),
    "syndicate": (ROOT / "specs/architectures/syndicate.yaml", 3.0),
}


@pytest.mark.parametrize("name", short(RUNS, 0))
def test_steps_and_their_past_are_those_of_the_recording(name: str, tmp_path: Path) -> None:
    spec, duration_s = RUNS[name]
    package, file = written(spec, tmp_path), tmp_path / "run.mcap"
    options: dict[str, Any] = {"duration_s": duration_s, "record": file}
    with shown(package, speed=2.0, **options) as run:
        run.thread.join()
    states = run.server.whole()
    assert len(states) > 10
    recorded = {
        (topic[1:], data["stamp"]): data
        for topic, found in messages(file).items()
        for _, data in found
        if "stamp" in data and "state" in data
    }
    for state in states:
        for subsystem, one in state["steps"].items():
            assert one["step"] == recorded[subsystem, one["stamp"]]
            before = recorded.get((subsystem, one["stamp"] - 1))
            assert one["memory"] == (before["memory"] if before else None)
    index = Index(file)
    for state in states[3::7]:
        for seen in seen_at(index, state["time_s"]):
            one = state["steps"].get(seen.name)
            if one is None or one["stamp"] != seen.step["stamp"]:
                continue  # it began by then, but nobody has seen it yet
            found = one["entered_s"], one["since_s"], one["row"], one["memory"]
            assert found == (seen.entered_s, seen.since_s, seen.row, seen.memory)


def test_every_change_of_state_is_a_span(gate: Code, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    with shown(gate, duration_s=6.0, record=file) as run:
        run.thread.join()
    changes = [change for each in run.server.of("spans") for change in each["changes"]]
    found = messages(file)
    for topic in ("/gate.c", "/belt.c"):
        steps = [data for _, data in found[topic]]
        entered = [[topic[1:], s["time"], s["state"], s["transition"]] for s in steps
                   if s["row"] >= 0 or not s["before"]]  # fmt: skip
        assert [change for change in changes if change[0] == topic[1:]] == entered


def test_the_beginning_and_the_end(gate: Code, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    with shown(gate, duration_s=1.0, seed=3, report=report) as run:
        run.thread.join()
    (begin,), (end,) = run.server.of("begin"), run.server.of("end")
    assert run.server.messages[0] == begin
    assert (begin["seed"], begin["tick_s"], begin["duration_s"]) == (3, 0.01, 1.0)
    assert begin["can"] == {"pause": True, "restart": True}
    assert {"name": "gate.c", "period_s": 0.05} in begin["subsystems"]
    assert begin["bodies"] == ["belt", "beam", "gate", "barrier"]
    assert {e["id"] for e in begin["scene"]["entities"]} >= {"belt", "gate"}
    assert (end["ended"], end["exit_code"]) == ("completed", 0)
    assert end["report"]["requirements"] == json.loads(report.read_text())["requirements"]
    last = run.server.of("state")[-1]
    assert (last["status"], last["time_s"]) == ("ended", 1.0)
    assert [r["verdict"] for r in last["requirements"]] == ["holds"] * 3  # a contract, too
    assert len(last["poses"]) == len(begin["bodies"]) and len(last["poses"][0]) == 7


@pytest.mark.long
def test_a_violation_and_a_fault_are_marks(tmp_path: Path) -> None:
    spec = RUNS["conveyor_gate"][0]
    package = written(spec, tmp_path, cruise="1[rad/s]", patience="2[s]")
    with shown(package, duration_s=20.0) as run:
        run.thread.join()
    marks = [mark for each in run.server.of("marks") for mark in each["marks"]]
    (violated,) = [mark for mark in marks if mark["kind"] == "violation"]
    entry = run.server.of("end")[0]["report"]["requirements"]
    (first,) = [each for each in entry if each["verdict"] == "violated"]
    assert (violated["time_s"], violated["text"]) == (first["time_s"], first["that"])
    state = run.server.of("state")[-1]
    verdicts = {each["verdict"] for each in state["requirements"]}
    assert "violated" in verdicts


@pytest.mark.long
def test_nothing_is_sampled_often_while_nobody_looks(gate: Code) -> None:
    with shown(gate, {"do": "watch", "clients": 0}, speed=1.0, duration_s=2.5) as run:
        run.thread.join()
    assert 3 <= len(run.server.of("state")) <= 6
    assert run.server.of("spans")


def _show_at_once(link: Link, content: Content) -> None:
    """Nothing newer takes the place of what is shown."""
    link.post(content() if callable(content) else content)


@pytest.mark.long
def test_what_moves_comes_more_often_than_the_rest(
    gate: Code, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a clock and a line that no load of the machine makes slower."""
    monkeypatch.setattr(Link, "show", _show_at_once)
    with on_the(DrivenClock()), shown(gate, speed=1.0, duration_s=4.0) as run:
        run.thread.join()
    states, whole = run.server.of("state"), run.server.whole()
    assert len(states) > 1.3 * len(whole)
    moving = {"kind", "time_s", "wall_s", "status", "speed", "factor", "poses"}
    for state in states:
        assert set(state) == moving or state in whole
        assert state in whole or state["status"] == "running"
    assert whole[-1]["plant"] == whole[-2]["plant"] and whole[-1]["status"] == "ended"
    assert whole[-2]["time_s"] == whole[-1]["time_s"] == 4.0


@pytest.mark.long
def test_the_pace_is_not_measured_over_a_pause(gate: Code) -> None:
    with shown(gate, speed=1.0, duration_s=6.0) as run:
        server = run.server
        server.wait("state", lambda state: state["factor"])
        server.send("pause")
        assert server.paused()["factor"] is None
        time.sleep(1.5)
        after = len(server.messages)
        server.send("continue")
        found = server.wait("state", lambda state: state["factor"], after)
        assert found["status"] == "running" and found["factor"] > 0.7


def test_a_recording_has_the_verdicts(gate: Code, tmp_path: Path) -> None:
    file, report = tmp_path / "run.mcap", tmp_path / "report.json"
    with shown(gate, duration_s=6.0, record=file, report=report) as run:
        run.thread.join()
    found = [(record.log_time / 1e9, data["requirements"])
             for record, data in messages(file)["/requirements"]]  # fmt: skip
    assert [each["verdict"] for each in found[0][1]] == ["open", "open"] or found[0][0] > 0
    last = found[-1][1]
    for entry, each in zip(report_of(report)["requirements"], last, strict=True):
        assert (entry["verdict"], each["verdict"]) == ("met", "holds")
        assert entry["margin"] == each["margin"]
    times = [time_s for time_s, _ in found]
    changes = [
        now_s for (now_s, now), (_, before) in zip(found[1:], found, strict=False)
        if [e["verdict"] for e in now] != [e["verdict"] for e in before]
    ]  # fmt: skip
    between = [b - a for a, b in pairwise(times[:-1]) if b not in changes]
    assert all(gap >= 0.5 - 1e-6 for gap in between)


@pytest.mark.long
def test_steps_that_other_processes_make_are_seen(gate: Code, tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    assert main.run(gate.options(duration_s=3.0, record=file)) == 0
    found = messages(file)
    with shown(gate, speed=2.0, duration_s=3.0, apart=("belt.drive", "gate.eye")) as run:
        run.thread.join()
    states = run.server.whole()
    for name in ("belt.drive", "gate.eye", "gate.c"):
        recorded = {data["stamp"]: data for _, data in found[f"/{name}"]}
        seen = [state["steps"][name] for state in states if name in state["steps"]]
        assert len(seen) > 10
        for one in seen:
            assert one["step"] == recorded[one["stamp"]]
            if one["stamp"] > 0:
                assert one["memory"] == recorded[one["stamp"] - 1]["memory"]
