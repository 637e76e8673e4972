"""A run that is paused ends at once by Ctrl-C, and is no run that hangs."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from specc_runtime import application
from specc_runtime.companion import OutputLost
from specc_runtime.page.feed import Feed
from specc_runtime.recording.log import Log
from websockets.sync.client import connect

from tests.commands import ROOT
from tests.page.fake_server import GATE, Code, FakeServer, Shown, shown, written
from tests.page.runs import END_S, page_run

pytestmark = pytest.mark.long  # a browser or whole runs: seconds each

PROGRAM = """
import sys
from pathlib import Path
from specc_runtime.main import run
from specc_runtime.options import Options
from specc_runtime.page.page import Page

descriptor, package, base, report = sys.argv[1:]
options = Options(
    directory=Path(package), base=Path(base), report=Path(report), duration_s=1000.0, quiet=True
)
page = Page(int(descriptor))
code = run(options, page)
page.close()
sys.exit(code)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_paused_run_ends_by_a_signal_with_safe_outputs(
    number: signal.Signals, tmp_path: Path
) -> None:
    code = written(ROOT / "specs/architectures/reactive.yaml", tmp_path)
    report = tmp_path / "report.json"
    ours, theirs = socket.socketpair()
    words = [str(theirs.fileno()), str(code.package), str(code.spec.parent), str(report)]
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, *words],
            pass_fds=(theirs.fileno(),),
            stderr=subprocess.PIPE,
        )
    server = FakeServer(ours)
    server.send("watch", clients=1)
    server.wait("state")
    server.send("pause")
    server.paused()
    begin_s = time.monotonic()
    process.send_signal(number)
    _, errors = process.communicate(timeout=20)
    assert time.monotonic() - begin_s < 2.0
    assert process.returncode == 128 + number, errors
    found = json.loads(report.read_text())
    assert found["ended"] == "interrupted"
    assert found["last_outputs"]
    assert all(not last["problem"] for last in found["last_outputs"].values())
    assert server.wait("end")["ended"] == "interrupted"
    assert server.of("state")[-1]["status"] in ("paused", "ended")


def test_the_watchdog_takes_a_pause_for_progress(
    gate: Code, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    made = application.Watchdog
    monkeypatch.setattr(
        application, "Watchdog", lambda *args, **named: made(*args, patience_s=0.4, **named)
    )
    with shown(gate, {"do": "pause"}, duration_s=5.0) as run:
        run.server.paused()
        time.sleep(1.5)
    assert "no progress" not in capfd.readouterr().err


def test_a_run_whose_server_went_before_it_began_stops_at_no_breakpoint(gate: Code) -> None:
    entered = {"kind": "state", "machine": "gate.c", "state": "passing"}
    run = Shown(gate.options(duration_s=20.0))
    run.server.send("break", breakpoints=[entered])
    run.server.end.shutdown(socket.SHUT_RDWR)
    while not run.page._link.is_over:
        time.sleep(0.01)
    run.start().join()
    assert run.code == 0


def test_outputs_are_safe_before_the_page_looks_for_the_last_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code = written(ROOT / "specs/architectures/reactive.yaml", tmp_path)
    report = tmp_path / "report.json"

    def interrupted(self: Feed) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Feed, "rest", interrupted)
    with shown(code, duration_s=1.0, report=report):
        pass
    assert json.loads(report.read_text())["last_outputs"]


def test_a_signal_ends_a_run_that_is_to_start_again(tmp_path: Path) -> None:
    with page_run(tmp_path, "run", GATE, "--ui", "--duration", 1000) as run:
        origin = f"http://127.0.0.1:{run.port}"
        cookie = {"Cookie": run.cookie}
        with connect(f"ws{origin[4:]}/ws", origin=origin, additional_headers=cookie) as browser:
            while json.loads(browser.recv())["type"] != "now":
                pass
            os.kill(run.process.pid, signal.SIGSTOP)
            browser.send(json.dumps({"type": "restart", "from_s": None, "set": {}}))
            time.sleep(0.3)
            run.process.terminate()
            os.kill(run.process.pid, signal.SIGCONT)
            assert run.process.wait(END_S) == 128 + signal.SIGTERM


@pytest.mark.no_replay("not complete")
@pytest.mark.parametrize("asked_for", ["snapshots", "record"])
def test_only_a_file_that_was_asked_for_is_missed(
    asked_for: str, gate: Code, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Log) -> None:
        raise OutputLost("the disk is full")

    monkeypatch.setattr(Log, "close", full)
    with shown(gate, duration_s=1.0, **{asked_for: tmp_path / "run.mcap"}) as run:
        run.thread.join(20)
    assert run.code == (0 if asked_for == "snapshots" else 2)
