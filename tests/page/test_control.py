"""A page stops a run, lets it go on, and makes it faster or slower; breakpoints stop it."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest

from tests.commands import specc
from tests.page.fake_server import GATE, Code, Message, shown, written
from tests.seeds import every

BREAK: dict[str, tuple[Message, str]] = {
    "state": (
        {"kind": "state", "machine": "gate.c", "state": "passing"},
        "state(gate.c) == passing",
    ),
    "row": (
        {"kind": "row", "machine": "gate.c", "row": "opening terminal always -> passing"},
        "state(gate.c) == passing",
    ),
    "condition": (
        {"kind": "condition", "machine": "belt.c", "condition": "held"},
        "state(belt.c) == holding",
    ),
}
SENT = "belt.c.drive.v_d"


def stop_when(formula: str, report: Path, *options: object) -> tuple[float, float]:
    """When a formula held first, and when the run ended for it."""
    done = specc(
        "run", GATE, "--stop-when", formula, "--duration", 20, "--report", report, *options
    )
    found = json.loads(report.read_text())
    assert found["stop_when"]["met_s"] is not None, done.stderr
    return found["stop_when"]["met_s"], found["simulated_s"]


def broken(code: Code, *breakpoints: Message) -> tuple[Message, Message]:
    """What is said of the first stop there, and the state then."""
    asked = {"do": "break", "breakpoints": list(breakpoints)}
    with shown(code, asked, duration_s=20.0) as run:
        state = run.server.paused()
        (stopped,) = run.server.of("stopped")
        time.sleep(0.2)
        assert run.server.of("state")[-1]["time_s"] == state["time_s"]
        return stopped, state


@pytest.mark.parametrize("kind", every(3, list(BREAK)))
def test_a_breakpoint_stops_when_stop_when_would_end_the_run(
    kind: str, gate: Code, tmp_path: Path
) -> None:
    asked, formula = BREAK[kind]
    met_s, ended_s = stop_when(formula, tmp_path / "report.json")
    stopped, state = broken(gate, {"id": 7, **asked})
    assert state["time_s"] == pytest.approx(ended_s, abs=1e-9)
    assert state["steps"][asked["machine"]]["step"]["time"] == pytest.approx(met_s)
    assert stopped["why"].startswith(asked["machine"])


@pytest.mark.long
def test_a_violated_requirement_stops_when_its_negation_would_end_the_run(tmp_path: Path) -> None:
    constants = {"cruise": "1[rad/s]", "patience": "2[s]"}
    code = written(GATE, tmp_path, **constants)
    that = "state(gate.c) == opening implies belt.E.drive.v_m < 0.1[rad/s]"
    settings = [word for name, text in constants.items() for word in ("--set", f"{name}={text}")]
    met_s, ended_s = stop_when(f"not ({that})", tmp_path / "report.json", *settings)
    _, state = broken(code, {"kind": "requirement", "that": f"always({that})"})
    assert state["time_s"] == pytest.approx(ended_s, abs=1e-9)
    assert state["requirements"][0] == {
        "verdict": "violated",
        "margin": pytest.approx(state["requirements"][0]["margin"]),
        "time_s": pytest.approx(met_s),
    }


def test_a_sent_value_stops_when_it_can_be_seen(gate: Code, tmp_path: Path) -> None:
    met_s, _ = stop_when("belt.c.y.drive.v_d > 0[rad/s]", tmp_path / "report.json")
    element = {"kind": "sent", "machine": "belt.c", "element": "drive.v_d"}
    _, state = broken(gate, {**element, "op": ">", "value": 0})
    assert state["time_s"] == pytest.approx(met_s + 0.01, abs=1e-9)
    _, state = broken(gate, element)
    assert state["steps"]["belt.c"]["stamp"] == 0


def test_a_step_goes_to_the_next_one_of_the_machine(gate: Code) -> None:
    with shown(gate, {"do": "pause"}, duration_s=20.0) as run:
        run.server.paused()
        stamps = []
        for number in range(5):
            mark = len(run.server.messages)
            run.server.send("step", machine="gate.c")
            run.server.wait("stopped", after=mark)
            before = len(run.server.of("stopped"))
            assert before == number + 1
            stopped_s = run.server.of("stopped")[-1]["time_s"]
            state = run.server.wait(
                "state", lambda s, t=stopped_s: s["status"] == "paused" and s["time_s"] >= t
            )
            stamps.append(state["steps"]["gate.c"]["stamp"])
        assert stamps == [0, 1, 2, 3, 4]


@pytest.mark.long
def test_a_run_pauses_goes_on_and_changes_its_speed(gate: Code) -> None:
    with shown(gate, speed=1.0, duration_s=30.0) as run:
        server = run.server
        server.wait("state", lambda state: state["time_s"] > 0.3)
        server.send("pause")
        paused_s = server.paused()["time_s"]
        time.sleep(0.3)
        assert server.of("state")[-1]["time_s"] <= paused_s + 0.02
        mark = len(server.messages)
        server.send("continue")
        server.wait("state", lambda state: state["status"] == "running", mark)
        server.send("speed", value=0.1)
        server.wait("state", lambda state: state["speed"] == 0.1, mark)
        begin_s, wall_s = server.of("state")[-1]["time_s"], time.monotonic()
        time.sleep(1.0)
        passed_s = server.of("state")[-1]["time_s"] - begin_s
        assert passed_s <= 0.1 * (time.monotonic() - wall_s) + 0.03
        server.send("speed", value=None)
        run.thread.join(20)
        assert not run.thread.is_alive()
        server.wait("state", lambda state: state["status"] == "ended")


REFUSED = [
    (b"", "an object in JSON"),
    (b"nonsense", "an object in JSON"),
    (b"[1]", "an object in JSON"),
    (b"{}", "do is missing"),
    (b'{"do": 3}', "do is missing"),
    (b'{"do": "dance"}', "no command dance"),
    (b'{"do": "speed"}', ""),
    (b'{"do": "speed", "value": "fast"}', "value is missing"),
    (b'{"do": "speed", "value": NaN}', "an object in JSON"),
    (b'{"do": "speed", "value": true}', "value is missing"),
    (b'{"do": "speed", "value": 0}', "from 0.001 to 1000"),
    (b'{"do": "speed", "value": 1e999}', "an object in JSON"),
    (b'{"do": "step"}', "machine is missing"),
    (b'{"do": "step", "machine": "gate"}', "there are belt.c, "),
    (b'{"do": "break"}', "a list"),
    (b'{"do": "break", "breakpoints": {}}', "a list"),
    (b'{"do": "break", "breakpoints": [3]}', "kind is missing"),
    (b'{"do": "break", "breakpoints": [{"kind": "moon"}]}', "no breakpoints on moon"),
    (
        b'{"do": "break", "breakpoints": [{"kind": "state", "machine": "gate.c", "state": "S"}]}',
        "gate.c has no state S",
    ),
    (
        b'{"do": "break", "breakpoints": [{"kind": "row", "machine": "gate.c", "row": "S"}]}',
        "gate.c has no row S",
    ),
    (
        b'{"do":"break","breakpoints":[{"kind":"condition","machine":"gate.c","condition":"S"}]}',
        "a condition S",
    ),
    (b'{"do": "break", "breakpoints": [{"kind": "requirement", "that": "S"}]}', "requirement S"),
    (
        b'{"do": "break", "breakpoints": [{"kind": "sent", "machine": "gate.c", "element": "S"}]}',
        "gate.c sends no S",
    ),
    (
        b'{"do": "break", "breakpoints": [{"kind": "sent", "machine": "gate.c", '
        b'"element": "belt.go", "op": "=", "value": 1}]}',
        "op is one of",
    ),
    (
        b'{"do": "break", "breakpoints": [{"kind": "sent", "machine": "gate.c", '
        b'"element": "belt.go", "op": ["<"], "value": 1}]}',
        "op is missing",
    ),
    (
        b'{"do": "break", "breakpoints": [{"kind": "sent", "machine": "gate.c", '
        b'"element": "belt.go", "op": "<", "value": "1"}]}',
        "value is missing",
    ),
    (b'{"do": "set", "name": "cruise", "value": 1}', "value is missing, or no text"),
    (b'{"do": "restart", "from_s": -1}', "before the beginning"),
    (b'{"do": "restart", "from_s": "now"}', "from_s is missing"),
    (b'{"do": "restart", "from_s": null, "set": []}', "names and texts"),
    (b'{"do": "restart", "from_s": null, "set": {"a": 1}}', "names and texts"),
    (b'{"do": "watch", "clients": "many", "cameras": 3, "scene": []}', ""),
    (b'{"do": "watch", "cameras": [[], {}, 1]}', ""),
]


def test_what_is_no_command_is_refused(gate: Code) -> None:
    with shown(gate, {"do": "pause"}, duration_s=20.0) as run:
        run.server.paused()
        for text, words in REFUSED:
            before = len(run.server.of("refused"))
            run.server.end.sendall(text + b"\n")
            run.server.send("dance")
            until_s = time.monotonic() + 5
            while len(run.server.of("refused")) < before + 1 + bool(words):
                assert time.monotonic() < until_s, text
                time.sleep(0.002)
            first, *_ = run.server.of("refused")[before:]
            assert words in first["text"], text
        assert run.server.of("state")[-1]["status"] == "paused"


@pytest.mark.long
def test_a_run_in_real_time_has_no_pause(tmp_path: Path) -> None:
    code = written(GATE, tmp_path, real_time=True)
    early = {"do": "break", "breakpoints": [BREAK["row"][0]]}
    with shown(code, early, real_time=True, duration_s=2.0, inline=True) as run:
        run.server.wait("begin")
        for command in (
            {"do": "pause"},
            {"do": "step", "machine": "gate.c"},
            {"do": "speed", "value": 2},
            {"do": "restart", "from_s": None},
            {"do": "break", "breakpoints": [BREAK["row"][0]]},
        ):
            run.server.send(**command)
        run.thread.join(20)
    begin = run.server.of("begin")[0]
    assert (begin["real_time"], begin["can"]) == (True, {"pause": False, "restart": False})
    assert len(run.server.of("refused")) == 5
    assert all("real time" in each["text"] for each in run.server.of("refused"))
    state = run.server.of("state")[-1]
    assert state["real_time"].keys() == state["steps"].keys()
    assert all(each["late_ms"] >= 0 for each in state["real_time"].values())
