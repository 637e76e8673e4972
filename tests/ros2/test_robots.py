"""Robots, grippers and bases of ROS: their messages, and what the library does with them."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from specc_runtime.builtins import pose
from specc_runtime.operators.ros2 import gripper_goal, joint_point, time_to_rest
from specc_runtime.ros2.binding import Ros2, Ros2Topic
from specc_runtime.ros2.messages import message_of, value_of

from specc.cli import main
from specc.lower.system import ros2_arguments
from specc.pipeline import check_spec
from specc.testing import Stepped
from tests.docs.examples import examples
from tests.ros2.conftest import HERE, ROOT, Start, end

Spec = Callable[..., Path]
long = [pytest.mark.long, pytest.mark.no_replay("a test here replays its own recording")]


# The messages of the examples on the page, in classes of the same structure.


TURNED = np.array([0.0, 0.0, 1.0, 0.0])
AT = {
    "position": {"x": 2.0, "y": 1.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": 1.0, "w": 0.0},
}
STAMP = {"stamp": {"sec": 0, "nanosec": 0}}
POINTS = [joint_point(np.array([0.1, 0.2]), 1.5), joint_point(np.array([0.3, 0.4]), 2.0)]


def point(positions: list[float], sec: int, nanosec: int) -> dict[str, Any]:
    unused = {"accelerations": [], "effort": []}
    time = {"time_from_start": {"sec": sec, "nanosec": nanosec}}
    return {"positions": positions, "velocities": [0.0, 0.0], **unused, **time}


SENT: dict[str, tuple[Any, dict[str, Any]]] = {
    "a.E.arm.goal": (
        POINTS,
        {
            "trajectory": {
                "header": {**STAMP, "frame_id": ""},
                "joint_names": ["shoulder", "elbow"],
                "points": [point([0.1, 0.2], 1, 500_000_000), point([0.3, 0.4], 2, 0)],
            },
            "goal_time_tolerance": {"sec": 0, "nanosec": 0},
            "path_tolerance": [],
        },
    ),
    "hand.E.g.goal": (
        gripper_goal(0.02, 15.0),
        {"command": {"position": 0.02, "max_effort": 15.0}},
    ),
    "hand.E.finger.width_d": (
        0.02,
        {
            "command": {
                "header": {**STAMP, "frame_id": ""},
                "name": ["finger"],
                "position": [0.02],
                "velocity": [],
                "effort": [],
            }
        },
    ),
    "r.E.base.goal": (
        pose(np.array([2.0, 1.0, 0.0]), TURNED),
        {"pose": {"header": {**STAMP, "frame_id": "map"}, "pose": AT}, "behavior_tree": ""},
    ),
    "r.E.base.V": (
        np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.1]),
        {
            "header": {**STAMP, "frame_id": "base_link"},
            "twist": {
                "linear": {"x": 0.3, "y": 0.0, "z": 0.0},
                "angular": {"x": 0.0, "y": 0.0, "z": 0.1},
            },
        },
    ),
}
GRIPPED = {"position": 0.01, "effort": 12.0, "stalled": True, "reached_goal": False}
ON_THE_WAY = {
    "current_pose": {"header": {"frame_id": "map"}, "pose": AT},
    "estimated_time_remaining": {"sec": 7, "nanosec": 250_000_000},
    "distance_remaining": 2.5,
}
READ: dict[str, tuple[Any, dict[str, Any]]] = {
    "a.E.arm.q": (
        [0.1, 0.2],
        {"joint_names": ["elbow", "shoulder"], "actual": {"positions": [0.2, 0.1]}},
    ),
    "a.E.arm.code": (-5, {"error_code": -5}),
    "a.E.arm.why": ("too far", {"error_string": "too far"}),
    "hand.E.g.width": (0.01, GRIPPED),
    "hand.E.g.force": (12.0, GRIPPED),
    "hand.E.g.stalled": (True, GRIPPED),
    "hand.E.finger.width": (
        0.01,
        {"state": {"name": ["other", "finger"], "position": [3.0, 0.01]}},
    ),
    "hand.E.finger.stalled": (True, {"stalled": True}),
    "r.E.base.left": (2.5, ON_THE_WAY),
    "r.E.base.time": (7.25, ON_THE_WAY),
    "r.E.base.T_MP": (pose(np.array([2.0, 1.0, 0.0]), TURNED).tolist(), ON_THE_WAY),
    "r.E.base.code": (103, {"error_code": 103}),
}


def on_the_page(folder: Path) -> Iterator[Ros2Topic]:
    """What is bound in the examples of the section on robots."""
    document = ROOT / "docs" / "ros2.md"
    first = document.read_text(encoding="utf-8").partition("\n## Robots")[0].count("\n")
    last = document.read_text(encoding="utf-8").partition("\n## Losses")[0].count("\n")
    for example in examples(document):
        if first < example.line < last:
            path = folder / "example.yaml"
            path.write_text(example.text, encoding="utf-8")
            system = check_spec(str(path)).system
            assert system is not None
            imports: Any = SimpleNamespace(runtime_name=lambda name: name)
            call = f"Ros2({', '.join(ros2_arguments(system, imports))})"
            yield from eval(call, {"Ros2": Ros2, "Ros2Topic": Ros2Topic}).topics


def filled(ros: str, *asked: tuple[str, str, dict[str, Any]]) -> list[dict[str, Any]]:
    """Messages with these fields set, of these types and parts of actions, in a Python of ROS."""
    path = os.pathsep.join(filter(None, (str(HERE / "stand_in"), os.environ.get("PYTHONPATH"))))
    lines = "".join(f"{json.dumps(each)}\n" for each in asked)
    command = [ros, str(HERE / "filling.py")]
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(
        command, input=lines, capture_output=True, text=True, env=environment, check=False
    )
    assert not done.returncode, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_messages_of_the_examples_are_as_they_are_bound(ros: str, tmp_path: Path) -> None:
    topics = {topic.name: topic for topic in on_the_page(tmp_path) if topic.part != "status"}
    assert topics.pop("a.R.tf.T_BE").between == ("base_link", "tool0")
    assert topics.keys() == SENT.keys() | READ.keys()
    bodies = {name: message_of(topics[name], value) for name, (value, _) in SENT.items()}
    bodies |= {name: fields for name, (_, fields) in READ.items()}
    asked = [(topics[name].type, topics[name].part, body) for name, body in bodies.items()]
    messages = dict(zip(bodies, filled(ros, *asked), strict=True))
    for name, (_, wanted) in SENT.items():
        assert messages[name] | wanted == messages[name], name
    for name, (value, _) in READ.items():
        np.testing.assert_array_equal(value_of(topics[name], messages[name]), value, name)


# The arm of the library.


REST = {"x.E.q_m": "[0, 0] * 1[rad]", "x.E.status": "none", "x.E.taken": None}


@pytest.fixture
def effector(tmp_path: Path) -> Stepped:
    """After its first step, at rest."""
    stepped = Stepped(HERE / "reach.yaml", "a.arm")
    stepped.step(REST)
    return stepped


def command(effector: Stepped) -> Any:
    """Have it go, and its device take the goal; returns that."""
    assert effector.step({"x.c.q_d": "[0.4, -0.3] * 1[rad]"}).endswith("-> moving")
    goal = effector.sent["y.E.goal"]
    assert effector.step({"x.E.status": "none", "x.E.taken": goal}) == ""
    return goal


def test_a_goal_takes_as_long_as_the_bounds_allow(effector: Stepped) -> None:
    goal = command(effector)
    bounds = np.ones(2), 2 * np.ones(2)
    assert goal.time_from_start == time_to_rest(np.zeros(2), goal.positions, *bounds)
    assert goal.time_from_start == pytest.approx(np.sqrt(6 * 0.4 / 2), abs=1e-3)
    assert goal.velocities.tolist() == [0.0, 0.0]
    assert effector["y.c.moving"] and not effector["y.c.failed"]


def test_the_status_of_another_goal_is_not_believed(effector: Stepped) -> None:
    first = command(effector)
    effector.step({"x.c.q_d": "[0.1, 0.1] * 1[rad]", "x.E.status": "succeeded"})
    assert effector.state == "moving"
    assert effector.step({"x.E.status": "aborted"}) == ""  # still that of the first
    second = effector.sent["y.E.goal"]
    assert second.positions.tolist() == [0.1, 0.1] != first.positions.tolist()
    effector.step({"x.E.status": "none", "x.E.taken": second})
    assert effector.step({"x.E.status": "succeeded"}).endswith("-> resting")
    assert effector.sent["y.E.goal"] is None


@pytest.mark.parametrize("status", ["aborted", "rejected", "canceled"])
def test_a_goal_that_does_not_succeed_has_failed(effector: Stepped, status: str) -> None:
    command(effector)
    assert effector.step({"x.E.status": status}).endswith("-> failed")
    assert effector["y.c.failed"] and effector.sent["y.E.goal"] is None
    effector.step({"x.c.q_d": "[0, 0] * 1[rad]"})
    assert not effector["y.c.failed"]


def test_halt_gives_the_goal_up_and_waits_for_its_end(effector: Stepped) -> None:
    command(effector)
    effector.step({"x.E.status": "executing"})
    assert effector.step({"x.c.halt": True}).endswith("-> stopping")
    assert effector.sent["y.E.goal"] is None
    assert effector.step({"x.E.taken": None, "x.E.status": "canceling"}) == ""
    assert effector["y.c.moving"]
    assert effector.step({"x.E.status": "canceled"}).endswith("-> resting")


def test_who_takes_too_long_has_failed(effector: Stepped) -> None:
    command(effector)
    effector.place("moving", periods=round((1.1 + 2) * 50) + 1)
    assert effector.step().endswith("-> failed")


# Against real nodes.


class TestRobots:
    """Each test starts its own."""

    pytestmark = long

    def test_a_trajectory_is_sent_on_a_topic(self, arm: Start, spec: Spec) -> None:
        follower = arm("follower", "/arm_controller/joint_trajectory", program="nodes.py")
        assert main(["run", str(spec(name="follow")), "--cycles", "1"]) == 0
        assert end(follower).splitlines()[:2] == [
            "0.25 {'q1': 0.2, 'q2': -0.1} 0.0 0.0",
            "0.5 {'q1': 0.4, 'q2': -0.3} 0.0 0.0",
        ]

    def test_a_record_is_a_goal_and_fields_of_a_result_are_elements(
        self, arm: Start, spec: Spec, tmp_path: Path
    ) -> None:
        server = arm("twice", "/twice", program="nodes.py")
        path, record = spec(name="nested"), tmp_path / "run.mcap"
        assert main(["run", str(path), "--cycles", "1", "--record", str(record)]) == 0
        assert end(server).splitlines() == [f"True {-2_500_000_000}"]
        assert main(["replay", str(record), "--spec", str(path)]) == 0

    def test_the_arm_of_the_library_tells_what_has_become_of_its_goals(
        self, arm: Start, spec: Spec
    ) -> None:
        action = "/arm_controller/follow_joint_trajectory"
        outcomes = ("succeed", "abort", "reject", "wait", "succeed")
        server = arm("server", action, *outcomes, program="nodes.py")
        arm("joints", "driver=q1,q2@50", program="nodes.py")
        known = "type: control_msgs/FollowJointTrajectory"
        path = spec(
            (f"{known}, part: goal, joints: [shoulder, elbow]", f"{known}, part: goal{THROUGH}"),
            (known, "type: test_msgs/Fibonacci"),
            ("[shoulder, elbow]", "[q1, q2]"),
            ("[1, 1] * 1[rad/s]", "[50, 50] * 1[rad/s]"),
            ("[2, 2] * 1[rad/s**2]", "[500, 500] * 1[rad/s**2]"),
            ('"2[s]"', '"0.5[s]"'),
            name="reach",
        )
        assert main(["run", str(path), "--cycles", "1"]) == 0
        assert end(server).splitlines()[:9] == [
            "succeed 200", "succeeded", "abort 200", "aborted", "reject",
            "wait 200", "canceled", "succeed 200", "succeeded",
        ]  # fmt: skip


THROUGH = ', through: "grasping:milliseconds"'
