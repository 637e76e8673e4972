"""Others command the agent, and it calls others: actions and services of a real ROS 2."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from specc.cli import main
from tests.ros2.conftest import Start, end, lines

pytestmark = [pytest.mark.long, pytest.mark.no_replay("a test here replays its own recording")]
Spec = Callable[..., Path]


@pytest.mark.parametrize("goals", [25, pytest.param(200, marks=pytest.mark.soak)])
def test_each_goal_of_an_impatient_client_ends_once(
    arm: Start, spec: Spec, tmp_path: Path, capsys: pytest.CaptureFixture[str], goals: int
) -> None:
    random = Random(goals)
    outcomes = random.choices(("succeed", "abort", "reject", "wait"), (3, 1, 1, 1), k=4 * goals)
    arm("server", "/grasp", *outcomes, program="nodes.py")
    strict = ("field: order, init", 'through: "grasping:wanted", init')
    path, record = spec(strict, name="skill"), tmp_path / "run.mcap"
    command = [sys.executable, "-m", "specc", "run", str(path), "--duration", "400"]
    with subprocess.Popen([*command, "--record", str(record)], stdout=subprocess.DEVNULL) as run:
        client = arm("client", "/pick", str(goals), "seed", program="nodes.py")
        said = lines(client, "done", 400.0)
        run.send_signal(signal.SIGINT)
    assert said == ["ends aborted canceled rejected succeeded", "done"]
    assert run.returncode == 130
    assert main(["replay", str(record), "--spec", str(path)]) == 0
    out = capsys.readouterr().out
    assert all(f"{name}: " in out and "the same" in out for name in ("a.c", "a.g", "a.s"))


def test_a_service_is_served_by_the_help_of_another_one(
    arm: Start, spec: Spec, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    switch = arm("switch", "/lamp", "succeed", "fail", "slow", program="nodes.py")
    presser = arm("presser", "/lamp/press", "4", program="nodes.py")
    path, record = spec(name="lamp"), tmp_path / "run.mcap"
    assert main(["run", str(path), "--duration", "8", "--record", str(record)]) == 0
    assert lines(presser, "done") == ["True", "False", "False", "False", "done"]
    assert end(switch).splitlines() == ["succeed True", "fail True", "slow True"]


def test_a_call_that_waits_is_answered_when_the_run_ends(arm: Start, spec: Spec) -> None:
    arm("switch", "/lamp", "succeed", program="nodes.py")
    presser = arm("presser", "/lamp/press", "1", program="nodes.py")
    long = ("elapsed > 0.1[s] and x.lamp.call in", "elapsed > 60[s] and x.lamp.call in")
    path = spec(long, ("answer_within: 3 s", "answer_within: 60 s"), name="lamp")
    assert main(["run", str(path), "--duration", "4"]) == 0
    assert lines(presser, "done") == ["False", "done"]


NO_STATUS = (
    ("    a.E.lamp.call: {service: /lamp, type: std_srvs/SetBool, part: status}\n", ""),
    ("call: Call, is_done", "is_done"),
    (" and x.lamp.call in {answered, missing, late}", ""),
    ("present(x.lamp.call) and elapsed", "elapsed"),
    (" and x.lamp.call == answered", ""),
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "changes", "said"),
    [
        (
            "retry",
            [("test_msgs/Fibonacci", "test_msgs/NestedMessage")],
            "the action /grasp (a.E.g.wanted) is served as test_msgs/action/Fibonacci, not as "
            "test_msgs/action/NestedMessage",
        ),
        (
            "lamp",
            [*NO_STATUS, ("std_srvs/SetBool", "std_srvs/Trigger")],
            "the service /lamp (a.E.lamp.on) is served as std_srvs/srv/SetBool, not as "
            "std_srvs/srv/Trigger",
        ),
        ("lamp", [*NO_STATUS, ("/lamp", "/lump")], "nobody serves the service /lump (a.E.lamp.on)"),
        (
            "skill",
            [("field: order, init", "field: number, init")],
            "/pick (a.E.s.order): test_msgs/Fibonacci has no field `number`: it has order",
        ),
    ],
)
def test_what_cannot_be_called_is_named(
    arm: Start,
    spec: Spec,
    capfd: pytest.CaptureFixture[str],
    name: str,
    changes: list[tuple[str, str]],
    said: str,
) -> None:
    arm("server", "/grasp", "succeed", program="nodes.py")
    arm("switch", "/lamp", "succeed", program="nodes.py")
    path = spec(*changes, ("wait: 20 s", "wait: 3 s"), name=name)
    assert main(["run", str(path), "--cycles", "1"]) == 2
    assert said in capfd.readouterr().err
