"""A page starts a run again: from its beginning, from a moment, and with other constants."""

from __future__ import annotations

import json
import socket
import sys
import time
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from typing import Any

import pytest
from specc_runtime.page.page import Page

from specc.cli import run as command
from specc.cli.arguments import parser
from specc.cli.page import PageRuns
from tests.commands import ROOT
from tests.page.browser import Page as Tab
from tests.page.fake import fake_run
from tests.page.fake_server import GATE, FakeServer
from tests.page.runs import TIME, page_run
from tests.recording.runs import report_of
from tests.runtime.desk import ENABLE, MODE, START, N, V
from tests.runtime.desk import SPEC as DESK
from tests.runtime.test_live_constants import spec_in

pytestmark = pytest.mark.long  # runs that begin more than once: seconds each

TELEOPERATION = ROOT / "specs/architectures/teleoperation.yaml"


class Runs(PageRuns):
    """The runs of a command whose server is the test."""

    server: FakeServer

    def _serve(self) -> None:
        ours, theirs = socket.socketpair()
        self.server = FakeServer(theirs)
        self.server.send("watch", clients=1, scene=False)
        self._page = Page(ours.detach(), None)


class CommandedRun:
    """`specc run` in a thread, with what came of it."""

    def __init__(self, spec: Path, folder: Path, *options: object) -> None:
        words = ["run", str(spec), "--ui", *map(str, options)]
        self._options: Namespace = parser().parse_args(words)
        self.runs = Runs(self._options, folder)
        self.code = -1
        self.thread = Thread(target=self._run)

    def _run(self) -> None:
        with self.runs:
            self.code = self.runs.all(lambda chosen: command._run(chosen, self.runs))

    @property
    def server(self) -> FakeServer:
        until_s = time.monotonic() + 20
        while not hasattr(self.runs, "server"):
            assert time.monotonic() < until_s
            time.sleep(0.01)
        return self.runs.server

    def ended(self, number: int) -> dict[str, Any]:
        """The message of the end of a run, the first of which is number 1."""
        until_s = time.monotonic() + 30
        while len(self.server.of("end")) < number:
            assert time.monotonic() < until_s, self.server.of("refused")
            time.sleep(0.01)
        return self.server.of("end")[number - 1]


@contextmanager
def commanded_run(spec: Path, *options: object) -> Iterator[CommandedRun]:
    with TemporaryDirectory() as folder:
        run = CommandedRun(spec, Path(folder), *options)
        run.thread.start()
        try:
            yield run
        finally:
            run.server.send("quit")
            run.thread.join(30)
            assert not run.thread.is_alive()


def digest(file: Path) -> str:
    return str(json.loads(file.read_text())["records_sha256"])


@pytest.mark.parametrize("spec", [GATE, TELEOPERATION], ids=lambda spec: spec.stem)
def test_a_run_that_was_started_again_ends_like_the_first(spec: Path, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    with commanded_run(spec, "--duration", 5, "--report", report) as run:
        run.ended(1)
        first = report_of(report)
        for number, from_s in enumerate((None, 2.3, 4.5, 1.2), 2):
            run.server.send("restart", from_s=from_s, set={})
            assert run.ended(number)["ended"] == "completed"
            again = report_of(report)
            assert again["records_sha256"] == first["records_sha256"]
            assert again["requirements"] == first["requirements"]
            begin = run.server.of("begin")[number - 1]
            assert begin["begin_s"] <= (from_s or 0.0)
            assert (begin["begin_s"] > 0.0) == (from_s is not None)
    assert run.server.of("refused") == []


def test_a_restart_ends_the_present_run(tmp_path: Path) -> None:
    with commanded_run(GATE, "--duration", 2000, "--report", tmp_path / "report.json") as run:
        state = run.server.wait("state", lambda state: state["time_s"] > 3.0)
        run.server.send("pause")
        run.server.paused()
        run.server.send("restart", from_s=2.0, set={"patience": "3[s]"})
        run.server.wait("begin", lambda begin: begin["set"])
        begin = run.server.of("begin")[-1]
        assert (begin["set"], begin["begin_s"]) == ({"patience": "3[s]"}, 2.0)
        after = run.server.messages.index(begin)
        spans = run.server.wait("spans", after=after)["changes"]
        first = run.server.wait("state", lambda state: "steps" in state, after)
        assert {"gate.c", "gate.eye", "belt.c"} <= {name for name, *_ in spans}
        for name, entered_s, entered, _ in spans:
            assert entered and entered_s <= first["time_s"], name
        later = run.server.wait("state", lambda s: s["time_s"] > state["time_s"] + 5, after=50)
        assert later["status"] == "running"


def test_a_page_asks_for_no_speed_which_robots_behind_ros_2_cannot_have(tmp_path: Path) -> None:
    options = parser().parse_args(["run", str(GATE), "--ui"])
    with PageRuns(options, tmp_path):
        assert options.speed is None


def test_a_constant_that_cannot_be_is_refused_and_another_one_works() -> None:
    with commanded_run(GATE, "--duration", 3) as run:
        run.ended(1)
        for text in ("3[kg]", "very much", ""):
            before = len(run.server.of("refused"))
            run.server.send("set", name="patience", value=text)
            until_s = time.monotonic() + 20
            while len(run.server.of("refused")) == before:
                assert time.monotonic() < until_s
                time.sleep(0.01)
        run.server.send("restart", from_s=None, set={"no_such": "1"})
        run.server.wait("refused", lambda refused: "no_such" in refused["text"])
        run.server.send("restart", from_s=1.0, set={"patience": "4[s]"})
        run.ended(2)
        assert run.server.of("begin")[-1]["set"] == {"patience": "4[s]"}


def test_what_the_page_did_is_done_again(tmp_path: Path) -> None:
    spec, report = tmp_path / "desk.yaml", tmp_path / "report.json"
    spec.write_text(DESK)
    with commanded_run(spec, "--duration", 6, "--report", report) as run:
        server = run.server
        server.send("speed", value=5.0)
        server.wait("state", lambda state: state["time_s"] > 0.5)
        server.send("panel", name=MODE, value="auto")
        server.send("panel", name=N, value=3)
        server.send("panel", name=START, value=True)
        for _ in range(5):
            server.send("hold", name=ENABLE, wall_s=time.perf_counter())
            time.sleep(0.03)
        held = server.wait("state", lambda state: state.get("panel", {}).get(ENABLE))
        assert (held["panel"][MODE], held["panel"][N]) == ("auto", 3)
        for wrong in (
            {"do": "panel", "name": N, "value": 1.5},
            {"do": "panel", "name": MODE, "value": "fast"},
            {"do": "panel", "name": V, "value": 1e9},
            {"do": "panel", "name": V},
            {"do": "panel", "name": ENABLE, "value": True},
            {"do": "hold", "name": START, "wall_s": 0.0},
            {"do": "hold", "name": ENABLE},
            {"do": "release", "name": "nothing"},
        ):
            server.send(**wrong)
        run.ended(1)
        server.send("panel", name=N, value=2)
        assert len(server.of("refused")) >= 7
        first = report_of(report)
        made = [(each["element"], each["value"], each["by"]) for each in first["panel"]]
        assert set(made) == {
            *((name, value, "page") for name, value in ((MODE, "auto"), (N, 3), (START, True))),
            *((ENABLE, value, "page") for value in (True, False)),
        }
        marks = [mark for each in server.of("marks") for mark in each["marks"]]
        assert [mark["kind"] for mark in marks].count("panel") == len(made)
        assert max(each["time_s"] for each in first["panel"]) < 5.5
        server.send("speed", value=None)
        server.send("restart", from_s=5.5, set={})
        run.ended(2)
        assert report_of(report)["records_sha256"] == first["records_sha256"]


def test_a_live_constant_changes_and_another_one_starts_the_run_again(tmp_path: Path) -> None:
    spec, report = spec_in(tmp_path), tmp_path / "report.json"
    with commanded_run(spec, "--duration", 3, "--report", report) as run:
        server = run.server
        server.send("speed", value=2.0)
        begin = server.wait("begin")
        bounds = {"least": 0.0, "greatest": 2.0, "value": 1.0, "whole": False}
        assert {"name": "v", "unit": "m/s", **bounds} in begin["live"]
        server.wait("state", lambda state: state["time_s"] > 0.5)
        server.send("set", name="v", value=0.5)
        server.send("set", name="v", value=3)
        server.wait("refused", lambda refused: "its range is" in refused["text"])
        server.send("set", name="most", value=1.5)
        server.wait("refused", lambda refused: "a whole number" in refused["text"])
        server.wait("state", lambda state: state.get("live", {}).get("v") == 0.5)
        server.send("speed", value=None)
        run.ended(1)
        first = report_of(report)
        changes = [(each["constant"], each["value"], each["by"]) for each in first["changes"]]
        assert changes == [("v", 0.5, "page")]
        server.send("restart", from_s=2.5, set={})
        run.ended(2)
        assert report_of(report)["records_sha256"] == first["records_sha256"]
        server.send("set", name="far", value="1[m]")
        server.wait("begin", lambda begin: begin["set"] == {"far": "1[m]"})
        run.ended(3)


@pytest.mark.no_replay("no recording")
def test_recordings_of_earlier_runs_stay(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    (tmp_path / "run-2.mcap").write_text("of an earlier command")
    with commanded_run(GATE, "--duration", 4, "--record", file) as run:
        run.ended(1)
        bytes_before = file.read_bytes()
        run.server.send("restart", from_s=2.0, set={})
        run.ended(2)
    assert file.read_bytes() == bytes_before
    assert (tmp_path / "run-2.mcap").read_text() == "of an earlier command"
    assert (tmp_path / "run-3.mcap").exists()


def test_ui_may_stand_before_the_specification() -> None:
    for words, port in ((["--ui", "a.yaml"], 0), (["a.yaml", "--ui=8080"], 8080)):
        assert parser().parse_args(["run", *words]).ui == port
    assert parser().parse_args(["run", "a.yaml"]).ui is None


@pytest.mark.parametrize("port", ["-1", "65536", "x", ""])
def test_a_port_is_a_number(port: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parser().parse_args(["run", "a.yaml", f"--ui={port}"])
    assert "--ui: " in capsys.readouterr().err
    assert sys.exc_info() == (None, None, None)


TRAY = ROOT / "specs/examples/tray_cell.yaml"


@pytest.mark.parametrize(
    ("constant", "words"),
    [
        ({"thin": "abc"}, ["thin=abc: `abc` is not there yet"]),
        ({"thin": ""}, ["thin=: the expression is empty"]),
        ({"thin": "0.5[m"}, ["thin=0.5[m: the bracket is not closed"]),
        ({"nothing": "1"}, ["nothing=1: unknown constant `nothing`", "`thin`"]),
        (
            {"thin": "0.5[s]"},
            ["thin=0.5[s]: `0.5[s]` is `real[s]`; expected `real[m]`", "tray_cell.yaml:16"],
        ),
    ],
)
def test_a_wrong_constant_is_refused_before_the_run_is_asked(
    constant: dict[str, str], words: list[str]
) -> None:
    with fake_run(str(TRAY)) as run:
        run.begin()
        with run.visit() as page:
            page.next("hello")
            page.send("restart", from_s=1.5, set=constant)
            text = page.next("refused")["text"]
            assert all(each in text for each in ["is not started again", *words]), text
            page.send("pause")
            assert run.command("pause", "restart")["do"] == "pause"
            page.send("restart", from_s=1.5, set={"thin": "0.012"})
            assert run.command("restart")["set"] == {"thin": "0.012"}


def test_a_run_without_snapshots_goes_on_from_no_other_past() -> None:
    """Its operators have no codec, and its first part ran with other constants."""
    with commanded_run(TRAY, "--duration", 1) as run:
        server = run.server
        run.ended(1)
        server.send("restart", from_s=0.4, set={"thin": "0.012"})
        run.ended(2)
        words = [each["text"] for each in server.of("starting")]
        assert words == ["starting again", "repeating until 0.4 s"]
        assert server.of("begin")[-1]["begin_s"] == 0.4
        server.send("restart", from_s=0.8, set={})
        text = server.wait("refused")["text"]
        assert "cannot go on from 0.8 s: it has no snapshots until then (" in text
        assert "before 0.4 s it ran with other constants" in text
        server.send("restart", from_s=0.2, set={"thin": "0.011"})
        run.ended(3)
        assert server.of("begin")[-1]["begin_s"] == 0.2
        assert len(server.of("refused")) == 1


def test_a_run_goes_on_from_before_its_first_own_snapshot(tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    with commanded_run(GATE, "--duration", 4, "--report", report) as run:
        run.ended(1)
        run.server.send("restart", from_s=2.05, set={"patience": "3[s]"})
        run.ended(2)
        first = digest(report)
        for number, from_s in enumerate((2.3, 2.05, 3.5), 3):
            run.server.send("restart", from_s=from_s, set={})
            run.ended(number)
            assert digest(report) == first
        assert run.server.of("refused") == []


def test_a_second_start_is_refused_while_one_is_under_way() -> None:
    with commanded_run(GATE, "--duration", 2000) as run:
        server = run.server
        server.wait("state", lambda state: state["time_s"] > 1.0)
        server.send("restart", from_s=None, set={})
        server.send("restart", from_s=None, set={"patience": "3[s]"})
        server.wait("refused", lambda refused: "a run is starting again" in refused["text"])
        server.wait("begin", after=5)
        server.wait("state", lambda state: state["time_s"] > 1.0, after=8)
        server.send("restart", from_s=None, set={"patience": "3[s]"})
        server.wait("begin", lambda begin: begin["set"] == {"patience": "3[s]"})


ANSWER = "(document.querySelector('#restart .answer')?.textContent ?? '')"
THIN = "document.querySelector('#restart [aria-label=thin]')"
START_AGAIN = "document.querySelector('#restart [value=start]').click()"


def test_the_dialog_stays_open_until_the_run_begins(page: Tab, tmp_path: Path) -> None:
    with page_run(tmp_path, "run", TRAY, "--ui", "--duration", 60) as run:
        page.size(1400, 900)
        page.open(run.url)
        page.wait_for("document.getElementById('time')?.textContent")
        page.wait_for(f"{TIME} > 0.5")
        page.evaluate("document.getElementById('again').click()")
        page.evaluate(f"{THIN}.value = 'abc'")
        page.evaluate(START_AGAIN)
        page.wait_for(f"{ANSWER}.includes('thin=abc')")
        assert page.evaluate("document.getElementById('restart').open")
        assert page.evaluate(f"{THIN}.value") == "abc"
        before_s = page.evaluate(TIME)
        page.wait_for(f"{TIME} > {before_s}")
        page.evaluate(f"{THIN}.value = '0.012'")
        page.evaluate("document.querySelector('#restart [value=here]').click()")
        page.evaluate(START_AGAIN)
        page.wait_for("!document.getElementById('restart').open")
        page.wait_for(f"{TIME} > {before_s}")
        page.wait_for("document.getElementById('status').textContent.startsWith('running')")
        assert page.errors() == []
