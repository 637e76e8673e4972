"""Nodes that set the parameters of a real node, and that read how a run goes on."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main
from tests.ros2.conftest import Start, end

pytestmark = [pytest.mark.long, pytest.mark.no_replay("a test here replays its own recording")]
Spec = Callable[..., Path]
NONE = "is no constant that may change; there are: v, tries"
REQUESTS = {
    "list": "start_type_description_service tries use_sim_time v",
    "describe v": "speed of the belt, in m/s: 0.0 to 1.0",
    "describe tries": ": 1 to 5",
    "get v": "0.9",
    "get tries": "2",
    "set v 3.0": "False v is not 3 m/s: its range is 0 to 1 m/s",
    "set v .nan": "False v is not nan m/s: its range is 0 to 1 m/s",
    "set v 1": "False v is a double, as 1.0, and not 1",
    "set v fast": "False v is a double, as 1.0, and not fast",
    "set v": "False v is a double, as 1.0, and not None",
    "set tries 9": "False tries is not 9: its range is 1 to 5",
    "set tries 2.0": "False tries is an integer, and not 2.0",
    "set other 1": f"False other {NONE}",
    "set use_sim_time true": f"False use_sim_time {NONE}",
    "strange v": "False ValueError: 99 is not a valid Parameter.Type",
    "many v": "False a request has at most 200 parameters",
    "burst v 0.9": "False there are more than 50 changes a second",
    "insist v 0.5": "True",
    "until v 0.5": "0.5",
    "until tries 5": "5",
    "set tries 1": "True",
    "set v 1.0": "True",
}
"""And what is answered: the task changes `tries` once `v` is 0.5, and the run ends with 1.0."""


def test_constants_are_parameters(
    arm: Start, spec: Spec, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, report, record = spec(name="tuned"), tmp_path / "report.json", tmp_path / "run.mcap"
    given = tmp_path / "parameters.yaml"
    given.write_text("/**: {ros__parameters: {tries: 2, lost: 1.0}}\n")
    tuner = arm("tuner", "/cell/tuned", *REQUESTS, program="nodes.py")
    options = ["--cycle-limit", "60", "--report", str(report), "--record", str(record)]
    named = ["-r", "__ns:=/cell", "-p", "v:=0.9", "--params-file", str(given)]
    assert main(["run", str(path), *options, "--ros-args", *named]) == 0
    said = end(tuner).splitlines()
    expected = [f"{request} {answer}" for request, answer in REQUESTS.items()]
    assert [line for line in said if not line.startswith("speed")] == expected
    # What is sent when the run ends may be lost.
    assert [line for line in said if line.startswith("speed")][:2] == ["speed 0.9", "speed 0.5"]
    changes = json.loads(report.read_text())["changes"]
    # The burst is one change, or some if steps were made meanwhile.
    made = dict.fromkeys((each["constant"], each["value"], each["by"]) for each in changes)
    assert list(made) == [
        ("v", 0.9, "parameter"),
        ("tries", 2, "parameter"),
        ("v", 0.5, "parameter"),
        ("tries", 5, "task"),
        ("tries", 1, "parameter"),
        ("v", 1.0, "parameter"),
    ]
    assert "the node has no parameters lost" in capfd.readouterr().err
    assert main(["replay", str(record), "--spec", str(path)]) == 0
    assert capfd.readouterr().out.count("the same") == 2


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("{v: 3.0}", "--ros-args: v is not 3 m/s: its range is 0 to 1 m/s"),
        ("{v: 1}", "--ros-args: v is a double, as 1.0, and not 1"),
        ("{use_sim_time: true}", "--ros-args: `use_sim_time` stands in the specification"),
    ],
)
def test_a_first_value_that_cannot_be_is_refused(
    spec: Spec, given: str, said: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "parameters.yaml"
    file.write_text(f"/tuned: {{ros__parameters: {given}}}\n")
    path = str(spec(name="tuned"))
    assert main(["run", path, "--ros-args", "--params-file", str(file)]) == 2
    assert said in capfd.readouterr().err


def test_a_parameter_that_every_node_has_is_no_constant(
    spec: Spec, capfd: pytest.CaptureFixture[str]
) -> None:
    path = spec(("tries", "use_sim_time"), name="tuned")
    assert main(["run", str(path)]) == 2
    assert "use_sim_time is a parameter of every node" in capfd.readouterr().err


def test_others_learn_how_a_run_goes_on(
    arm: Start, ros: str, spec: Spec, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    if subprocess.run([ros, "-c", "import diagnostic_msgs"], check=False).returncode:
        pytest.skip("no diagnostic_msgs in this ROS: make ros")
    doctor = arm("doctor", program="nodes.py")
    arm("--silent-after", "60")
    published = ("  bind:\n", "  publish: [diagnostics]\n  bind:\n")
    path = spec(("max_gap: 5 s", "max_gap: 2 s"), published)
    named = ["--ros-args", "-r", "__ns:=/left"]
    assert main(["run", str(path), "--duration", "60", *named]) == 1
    messages: list[dict[str, Any]] = [json.loads(line) for line in end(doctor).splitlines()]
    assert len(messages) >= 2 and all(message.pop("stamp") for message in messages)
    first, last = messages[0], messages[-1]
    assert set(first) == {"left/irp: irp.c", "left/irp: irp.m", "left/irp: irp.s"}
    arm_of_first = first["left/irp: irp.m"]
    assert arm_of_first["level"] < 2 and arm_of_first["hardware_id"] == "arm"
    assert {"state", "lateness (ms)", "skipped periods"} < set(arm_of_first["values"])
    assert float(arm_of_first["values"]["age of x.E.q_m (ms)"]) > 0
    assert {each["level"] for each in last.values()} == {2}
    assert "`max_gap` is 2 s" in last["left/irp: irp.m"]["message"]


def test_diagnostics_without_their_messages_are_said_once(
    arm: Start, spec: Spec, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    (tmp_path / "diagnostic_msgs.py").write_text("raise ImportError('not installed')\n")
    arm()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert main(["run", str(spec()), "--cycles", "1", "--publish", "diagnostics"]) == 0
    said = capfd.readouterr().err
    assert said.count("warning: there are no diagnostics: this ROS has no package") == 1
