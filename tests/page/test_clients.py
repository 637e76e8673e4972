"""Browsers of a run: one controls, none delays another, and none gets more than it takes."""

from __future__ import annotations

import json
import socket
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosedError

from specc.tools.page.clients import _MOST_BYTES
from specc.tools.page.live import LiveRun
from specc.tools.page.messages import json_text
from tests.page.fake import FakeRun, Visitor, fake_run

GATE = "specs/conveyor_gate.yaml"


@pytest.fixture
def run() -> Any:
    with fake_run(GATE) as started:
        yield started


def control(visitor: Visitor, controls: bool, clients: int) -> None:
    """Wait until the browser is told so."""
    wanted = {"type": "control", "controls": controls, "clients": clients}
    while visitor.next("control") != wanted:
        pass


def test_one_browser_controls_and_another_takes_it(run: FakeRun) -> None:
    with run.visit() as first:
        assert first.next("hello")["controls"] is True
        with run.visit() as second:
            assert second.next("hello")["controls"] is False
            control(first, True, 2)
            control(second, False, 2)
            second.send("pause")
            assert "controls" in second.next("refused")["text"]
            first.send("speed", value=2.5)
            assert run.command("speed", "pause") == {"do": "speed", "value": 2.5}
            second.send("take")
            control(first, False, 2)
            control(second, True, 2)
            second.send("pause")
            assert run.command("speed", "pause") == {"do": "pause"}
            first.send("continue")
            first.next("refused")
        control(first, True, 1)
        first.send("step", machine="gate.c")
        assert run.command("step") == {"do": "step", "machine": "gate.c"}


def test_the_run_is_told_who_watches_what(run: FakeRun) -> None:
    def watch(clients: int, cameras: list[str], scene: bool) -> None:
        wanted = {"do": "watch", "clients": clients, "cameras": cameras, "scene": scene}
        while run.command("watch") != wanted:
            pass

    watch(0, [], False)
    with run.visit() as first, run.visit() as second:
        watch(2, [], True)
        for each, camera in ((first, "top"), (second, "side")):
            each.send("watch", signals=[], camera=camera, scene=False)
        watch(2, ["side", "top"], False)
        run.send("picture", camera="top", time_s=1.5, jpeg="//79")
        message = first.next_binary()
        length = int.from_bytes(message[:4], "big")
        assert json.loads(message[4 : 4 + length]) == {"camera": "top", "time_s": 1.5}
        assert message[4 + length :] == b"\xff\xfe\xfd"
    watch(0, [], False)


def test_commands_reach_the_run_as_they_are(run: FakeRun) -> None:
    breakpoints = [
        {"id": 1, "kind": "state", "machine": "gate.c", "state": "opening"},
        {
            "id": 2,
            "kind": "sent",
            "machine": "belt.c",
            "element": "drive.v_d",
            "op": ">",
            "value": 1,
        },
    ]
    commands: list[dict[str, Any]] = [
        {"type": "continue"},
        {"type": "speed", "value": None},
        {"type": "break", "breakpoints": breakpoints},
        {"type": "set", "name": "cruise", "value": 0.25},
        {"type": "panel", "name": "desk.R.buttons.mode", "value": "auto"},
        {"type": "panel", "name": "desk.R.buttons.stop", "value": True},
        {"type": "hold", "name": "desk.R.buttons.enable", "wall_s": 1.5},
        {"type": "release", "name": "desk.R.buttons.enable"},
        {"type": "restart", "from_s": 1.5, "set": {"cruise": "0.3[rad/s]"}},
        {"type": "restart", "from_s": None, "set": {}},
    ]
    with run.visit() as visitor:
        for command in commands:
            visitor.send(**command, more="is not passed on")
            wanted = {"do": command["type"], **command}
            del wanted["type"]
            assert run.command(command["type"]) == wanted
        assert visitor.next("breakpoints")["breakpoints"] == []
        assert visitor.next("breakpoints")["breakpoints"] == breakpoints
    with run.visit() as later:
        assert later.next("breakpoints")["breakpoints"] == breakpoints


MALFORMED: list[Any] = [
    "",
    "{",
    "null",
    "[]",
    "1",
    '"pause"',
    "{}",
    '{"type": 1}',
    '{"type": "nothing"}',
    '{"type": "speed", "value": NaN}',
    '{"type": "speed", "value": 1e999}',
    "[" * 100_000,
    '{"type": "speed", "value": 0}',
    '{"type": "speed", "value": "fast"}',
    '{"type": "speed", "value": true}',
    '{"type": "look"}',
    '{"type": "look", "id": 1, "time_s": "now"}',
    '{"type": "look", "id": [], "time_s": 1}',
    '{"type": "why", "id": 1, "time_s": null}',
    '{"type": "why", "id": 1, "machine": 3}',
    '{"type": "series", "id": 1, "name": "gate.c"}',
    '{"type": "series", "id": 1, "name": "a", "window_s": -1}',
    '{"type": "watch", "signals": {}}',
    '{"type": "watch", "signals": [1]}',
    '{"type": "watch", "camera": []}',
    '{"type": "break"}',
    '{"type": "break", "breakpoints": [[]]}',
    '{"type": "break", "breakpoints": [{"a": {}}]}',
    '{"type": "set", "name": "cruise"}',
    '{"type": "set", "name": "cruise", "value": {}}',
    '{"type": "set", "name": null, "value": 1}',
    '{"type": "restart", "set": {"a": 1}}',
    '{"type": "restart", "from_s": []}',
    '{"type": "step"}',
    '{"type": "hold", "name": "%s"}' % ("x" * 5000),
    '{"type": "speed", "value": %s}' % ("9" * 4000),
    b"\xff\xfe",
    "\ud83d".encode("utf-8", "surrogatepass"),
]


def test_what_is_no_message_is_refused_and_nothing_else_happens(run: FakeRun) -> None:
    with run.visit() as visitor:
        for text in MALFORMED:
            visitor.connection.send(text)
            assert visitor.next("refused")["text"], text
        assert visitor.ask("look")["id"] == 7
        visitor.send("pause")
        assert (
            run.command("pause", "speed", "set", "break", "restart", "hold", "step")["do"]
            == "pause"
        )


@pytest.mark.long
def test_a_message_of_a_megabyte_ends_the_connection_alone(run: FakeRun) -> None:
    with run.visit() as other, run.visit() as visitor:
        visitor.connection.send(json.dumps({"type": "look", "id": 1, "x": "x" * (1 << 20)}))
        with pytest.raises(ConnectionClosedError):
            visitor.next("moment")
        control(other, True, 1)


@pytest.mark.long
def test_unknown_names_are_no_end_of_answers(run: FakeRun) -> None:
    with run.visit() as visitor:
        visitor.next("hello")
        assert visitor.ask("why", machine="nothing.c")["lines"]
        series = visitor.ask("series", name="nothing", window_s=1)
        assert (series["t"], series["lines"]) == ([], [])
        visitor.send("watch", signals=["nothing", "gate.c.x.eye.parcel"])
        assert visitor.ask("look", time_s=1e11)["values"].keys() == {"gate.c.x.eye.parcel"}


@pytest.mark.long
def test_only_the_newest_question_is_answered(run: FakeRun) -> None:
    with run.visit() as visitor:
        visitor.next("hello")
        for step in range(400):
            run.state(step / 20)
        visitor.next("now")
        for number in range(40):
            visitor.send("look", id=number, time_s=number / 4)
            time.sleep(0.001)
        begin_s, answers = time.monotonic(), [visitor.next("moment")]
        while answers[-1]["id"] < 39:
            answers.append(visitor.next("moment"))
        assert time.monotonic() - begin_s < 2
        assert [each["id"] for each in answers] == sorted({each["id"] for each in answers})
        assert answers[-1]["time_s"] == 9.75


def memory_mb(process: int) -> float:
    lines = Path(f"/proc/{process}/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024


def never_reading(run: FakeRun) -> socket.socket:
    """A browser that shakes hands and reads nothing after it."""
    end = socket.create_connection(("127.0.0.1", run.port))
    end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    host = f"127.0.0.1:{run.port}"
    end.sendall(
        f"GET /ws HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nCookie: {run.cookie}\r\n"
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
    )
    assert end.recv(12).startswith(b"HTTP/1.1 101")
    return end


@pytest.mark.long
def test_a_browser_that_never_reads_costs_nothing_and_is_dropped(run: FakeRun) -> None:
    with run.visit() as visitor, never_reading(run):
        control(visitor, True, 2)
        before_mb, late_s = memory_mb(run.process.pid), []
        large = {"planes": {"value": "x" * 30_000}}
        for step in range(600):
            sent_s = time.monotonic()
            run.state(step / 20, live=large)
            while visitor.next("now")["time_s"] < step / 20:
                pass
            late_s.append(time.monotonic() - sent_s)
        assert sorted(late_s)[300] < 0.05
        # What is kept of the past is 18 MB of it.
        assert memory_mb(run.process.pid) - before_mb < 40
        control(visitor, True, 1)


def test_a_browser_that_comes_late_gets_the_past(run: FakeRun) -> None:
    run.send("spans", changes=[["gate.c", 0.0, "closed", ""], ["gate.c", 1.5, "halting", "a row"]])
    run.send("marks", marks=[{"time_s": 1.0, "kind": "fault", "text": "it broke"}])
    run.state(2.0)
    with run.visit() as visitor:
        assert visitor.next("spans") == {
            "type": "spans",
            "spans": {"gate.c": [[0.0, 1.5, "closed"], [1.5, None, "halting"]]},
            "replace": True,
        }
        assert visitor.next("marks")["marks"] == [
            {"time_s": 1.0, "kind": "fault", "text": "it broke"}
        ]
        assert visitor.next("now")["time_s"] == 2.0
        run.send("spans", changes=[["gate.c", 2.25, "opening", "another"]])
        later = visitor.next("spans")
        assert (later["spans"], later["replace"]) == ({"gate.c": [[2.25, None, "opening"]]}, False)


@pytest.mark.long
def test_a_state_without_steps_says_only_what_is_new(run: FakeRun) -> None:
    news = {"time_s": 2.05, "wall_s": 7.5, "status": "running", "speed": 1.0, "factor": 0.9}
    news["poses"] = [[1.0] * 7]
    run.state(2.0, live={"cruise": 3.0})
    with run.visit() as visitor:
        visitor.next("now")
        run.send("state", **news)
        assert visitor.next("now") == {"type": "now", **news}
        with run.visit() as late:
            whole = late.next("now")
            assert whole.items() >= news.items()
            assert (whole["live"], whole["requirements"]) == ({"cruise": 3.0}, [])
        assert visitor.ask("look")["time_s"] == 2.0
        run.state(2.1)
        later = visitor.next("now")
        assert (later["time_s"], later["live"], later["poses"]) == (2.1, {}, None)


@pytest.mark.long
def test_spans_that_say_nothing_new_are_not_sent(run: FakeRun) -> None:
    run.state(1.0)
    with run.visit() as visitor:
        visitor.next("now")
        run.send("spans", changes=[["gate.c", 0.0, "closed", ""]])
        run.send("spans", changes=[["gate.c", 0.5, "closed", "a row"]])
        run.send("spans", changes=[["gate.c", 1.0, "halting", "a row"]])
        assert visitor.next("spans")["spans"] == {"gate.c": [[0.0, None, "closed"]]}
        assert visitor.next("spans")["spans"] == {"gate.c": [[1.0, None, "halting"]]}


def test_a_run_that_begins_anew_begins_anew_in_the_page(run: FakeRun) -> None:
    run.send("spans", changes=[["gate.c", 0.0, "closed", ""]])
    run.state(2.0)
    with run.visit() as visitor:
        constants = {c["name"]: c["text"] for c in visitor.next("hello")["constants"]}
        assert constants["cruise"] == "0.5[rad/s]"
        run.begin(begin_s=1.5, set={"cruise": "0.25[rad/s]"})
        hello = visitor.next("hello")
        constants = {c["name"]: c["text"] for c in hello["constants"]}
        assert constants["cruise"] == "0.25[rad/s]"
        assert (hello["begin_s"], hello["set"]) == (1.5, {"cruise": "0.25[rad/s]"})
        assert visitor.next("spans")["spans"] == {}
        assert visitor.next("now")["time_s"] == 1.5
        run.begin(set=["cruise"])
        assert "not understood" in visitor.next("refused")["text"]
        assert visitor.ask("look")["time_s"] == 1.5


@pytest.mark.long
def test_a_page_that_comes_before_the_run_waits_for_it() -> None:
    with fake_run(GATE, begins=False) as run, run.visit() as visitor:
        assert visitor.next("control", "hello")["type"] == "control"
        visitor.send("look", id=1, time_s=None)
        visitor.next("refused")
        run.begin()
        assert visitor.next("hello")["title"] == "Conveyor with a gate"


@pytest.mark.long
def test_rows_that_follow_one_another_are_counted(run: FakeRun) -> None:
    again = [["gate.c", number / 20, "closed", "closed again"] for number in range(1, 201)]
    first = ["gate.c", 0.0, "closed", ""]
    run.send("spans", changes=[first, *again, ["gate.c", 10.05, "halting", "a row"]])
    step = {
        "stamp": 0, "before": "", "state": "closed", "cause": "", "row": -1, "transition": "",
        "conditions": {}, "fresh": {}, "x": {}, "y": {}, "memory": {},
    }  # fmt: skip
    for time_s in (4.0, 11.0):
        one = {"step": {**step, "time": time_s}, "memory": {}, "entered_s": 0.0, "since_s": 0.0}
        run.state(time_s, {"gate.c": one})
    with run.visit() as visitor:
        assert visitor.next("spans")["spans"]["gate.c"][0] == [0.0, 10.05, "closed"]
        for time_s, *texts in (
            (4.0, "0.05 s  closed again, 80 times until 4 s"),
            (None, "0.05 s  closed again, 200 times until 10 s", "10.05 s  a row"),
        ):
            lines = visitor.ask("why", machine="gate.c", time_s=time_s)["lines"]
            past = [line["text"].strip() for line in lines if line["role"] == "past"]
            assert past == ["last transitions:", *texts]


@pytest.mark.long
def test_spans_of_many_machines_are_not_too_many_for_a_browser_that_comes_late() -> None:
    run = LiveRun("specs/architectures/syndicate.yaml", {}, lambda command: None)
    names = list(run._description.subsystems)
    long = "a_state_with_a_name_that_is_as_long_as_names_are"
    for name in names:
        run._add([[name, number / 7, f"{long}_{number % 2}", ""] for number in range(20_000)])
    spans = run.spans()
    assert len(names) > 15 and all(spans[name][-1][0] == 19_999 / 7 for name in names)
    assert len(json_text(spans)) < _MOST_BYTES / 2


@pytest.mark.long
def test_a_browser_that_could_not_be_told_of_the_run_does_not_control_it() -> None:
    with fake_run(GATE, begins=False) as run:
        run.begin(panel=[3])
        with run.visit() as first, pytest.raises(ConnectionClosedError):
            first.next("hello")
        run.begin()
        hello = None
        while hello is None:  # the specification is read anew
            with run.visit() as later, suppress(ConnectionClosedError):
                hello = later.next("hello")
        assert hello["controls"] is True
