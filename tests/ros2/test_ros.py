"""The simulated arm behind topics of a real ROS 2: a task, its replay, and what is named if not."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main
from tests.docs.examples import data, examples
from tests.ros2.conftest import HERE, Start, end, says

pytestmark = [pytest.mark.long, pytest.mark.no_replay("a test here replays its own recording")]
Spec = Callable[..., Path]
DOCUMENT = HERE.parents[1] / "docs" / "ros2.md"


def test_a_task_is_done_and_replayed_without_ros(
    arm: Start, spec: Spec, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm()
    path, report, record = spec(), tmp_path / "report.json", tmp_path / "run.mcap"
    options = ["--cycles", "1", "--report", str(report), "--record", str(record)]
    assert main(["run", str(path), *options]) == 0
    told = json.loads(report.read_text())
    assert [cycle["ended"] for cycle in told["cycles"]] == ["completed"]
    assert told["real_time"]["ticks"] > 10
    capsys.readouterr()
    assert main(["replay", str(record), "--spec", str(path)]) == 0
    out = capsys.readouterr().out
    assert all(f"{name}: " in out and "the same" in out for name in ("irp.c", "irp.m", "irp.s"))


def test_the_example_of_the_documentation_runs(
    arm: Start, ros: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = next(e.text for e in examples(DOCUMENT) if not e.context)
    path, record = tmp_path / "rrbot.yaml", tmp_path / "rrbot.mcap"
    path.write_text(
        text.replace("/usr/bin/python3, wait: 5 s", f"{ros}, wait: 20 s").replace("500 ms", "5 s")
    )
    arm("--joints", "joint2,joint1", "--commands", "/forward_position_controller/commands")
    assert main(["run", str(path), "--cycles", "1", "--record", str(record)]) == 0
    assert main(["replay", str(record), "--spec", str(path)]) == 0
    assert "rr.arm: " in capsys.readouterr().out


def unhurried(text: str) -> str:
    """A specification without the limits of time that were measured."""
    return re.sub(r"max_age: \d+ m?s", "max_age: 20 s", re.sub("max_gap: .*", "max_gap: 5 s", text))


def test_the_graph_is_a_specification_that_commands_nothing(
    arm: Start, ros: str, tmp_path: Path
) -> None:
    robot, path = arm(), tmp_path / "irp.yaml"
    assert main(["init", "--ros2", str(path), "--python", ros, "--wait", "4"]) == 0
    text = path.read_text(encoding="utf-8")
    bind = data(text)["plant"]["bind"]
    kinds = {name: how.get("topic", how.get("action")) for name, how in bind.items()}
    assert kinds == {
        "irp.E.arm.q": "/joint_states",
        "irp.E.arm.q_d": "/position_controller/commands",
        "irp.R.ft_sensor_wrench.F": "/ft_sensor/wrench",
        "irp.R.tf_of_tests.T": "/tf_of_tests",
        "irp.E.grasp.status": "/grasp",
    }
    assert bind["irp.E.arm.q"]["joints"] == ["q1", "q2", "q3"]
    assert data(text)["plant"]["ros2"]["frames"]["ft_frame"] == "ft_frame"
    # What was measured holds on a machine that is not busy with other tests.
    path.write_text(unhurried(text), encoding="utf-8")
    assert main(["run", str(path), "--cycles", "1"]) == 0
    assert "commanded" not in end(robot)


def test_an_action_is_pursued_cancelled_and_replayed(
    arm: Start, spec: Spec, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gripper, path, record = arm(), spec(name="gripper"), tmp_path / "run.mcap"
    assert main(["run", str(path), "--cycles", "1", "--record", str(record)]) == 0
    assert end(gripper).split("\n")[-2] == "canceled"
    capsys.readouterr()
    assert main(["replay", str(record), "--spec", str(path)]) == 0
    assert "hand.c: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "goal", "outcomes"),
    [
        ("retry", 200, ["reject", "abort", "reject", "succeed"]),
        ("retry_sent", -1, ["reject", "reject", "abort", "succeed"]),
    ],
)
def test_a_goal_is_sent_again_until_it_succeeds(
    arm: Start, spec: Spec, name: str, goal: int, outcomes: list[str]
) -> None:
    server = arm("server", "/grasp", *outcomes, program="nodes.py")
    assert main(["run", str(spec(name=name)), "--cycles", "1"]) == 0
    said = {"abort": [f"abort {goal}", "aborted"], "succeed": [f"succeed {goal}", "succeeded"]}
    wanted = [line for each in outcomes for line in said.get(each, [each])]
    assert end(server).splitlines()[: len(wanted)] == wanted  # the next cycle has begun


def test_a_goal_after_one_that_took_too_long_knows_its_own_status(arm: Start, spec: Spec) -> None:
    server = arm("server", "/grasp", "wait", "wait", "succeed", program="nodes.py")
    assert main(["run", str(spec(name="retry_timed")), "--cycles", "1"]) == 0
    cancelled = ["wait 200", "canceled"]
    assert end(server).splitlines()[:6] == [*cancelled, *cancelled, "succeed 200", "succeeded"]


def test_transforms_are_poses(
    arm: Start, spec: Spec, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(HERE / "stand_in"))
    arm()
    assert main(["run", str(spec(name="poses")), "--cycles", "1"]) == 0
    lost = spec(("E: tool0", "E: tool1"), ("wait: 20 s", "wait: 3 s"), name="poses")
    assert main(["run", str(lost), "--cycles", "1"]) == 2
    assert "tf knows no transform from base_link to tool1 (a.R.t.T)" in capfd.readouterr().err
    begins = spec(("E: tool0", "E: tool1"), ("tf: {", "init: identity(), tf: {"), name="poses")
    assert main(["run", str(begins), "--duration", "1"]) == 0


def test_the_last_message_of_a_latched_topic_is_read(
    arm: Start, ros: str, spec: Spec, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arm("latched", "/e_stop", program="nodes.py")
    assert main(["run", str(spec(name="latched")), "--cycles", "1"]) == 0
    volatile = spec((", qos: {durability: transient_local}", ""), ("20 s", SHORT), name="latched")
    assert main(["run", str(volatile), "--cycles", "1"]) == 2
    assert "/e_stop (a.R.stop.on) is latched, and its message" in capfd.readouterr().err
    found = tmp_path / "found.yaml"
    assert main(["init", "--ros2", str(found), "--python", ros, "--wait", "4"]) == 0
    bind = data(found.read_text(encoding="utf-8"))["plant"]["bind"]
    assert bind["found.R.e_stop.value"]["qos"] == {"durability": "transient_local"}


def test_names_are_resolved_in_the_namespace_of_the_node(arm: Start, spec: Spec) -> None:
    arm("latched", "/cell/e_stop", program="nodes.py")
    path = spec(("node: latched", "node: /cell/latched"), ("/e_stop", "e_stop"), name="latched")
    assert main(["run", str(path), "--cycles", "1"]) == 0
    arm("latched", "/cell/latched/e_stop", program="nodes.py")
    path = spec(("node: latched", "node: /cell/latched"), ("/e_stop", "~/e_stop"), name="latched")
    assert main(["run", str(path), "--cycles", "1"]) == 0


STATE = "/event/a/c"


def test_a_topic_that_speaks_on_events_need_not_have_a_first_message(
    arm: Start, spec: Spec, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm("asker", STATE, "/go", *["Empty"] * 20, program="nodes.py")
    path, record = spec(name="event"), tmp_path / "run.mcap"
    assert main(["run", str(path), "--cycles", "1", "--record", str(record)]) == 0
    capsys.readouterr()
    assert main(["replay", str(record), "--spec", str(path)]) == 0
    out = capsys.readouterr().out
    assert all(f"{name}: " in out and "the same" in out for name in ("a.ask", "a.arm", "a.c"))


def test_silence_is_no_fault_where_no_message_is_awaited(
    spec: Spec, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, record = spec(name="event"), tmp_path / "run.mcap"
    assert main(["run", str(path), "--duration", "1", "--record", str(record)]) == 0
    assert main(["replay", str(record), "--spec", str(path)]) == 0
    gap = spec(("init: False", "init: False, max_gap: 500 ms"), name="event")
    assert main(["run", str(gap), "--duration", "20"]) == 1
    assert "a.R.ask.go: there has been no sample for" in "".join(capfd.readouterr())


@pytest.mark.parametrize(
    ("others", "changed", "said"),
    [
        (
            ["latched", "/go"],
            [],
            "/go (a.R.ask.go) is published as std_msgs/msg/Bool, not as std_msgs/msg/Empty",
        ),
        (
            ["latched", "/go"],
            [("std_msgs/Empty", "std_msgs/Bool")],
            "/go (a.R.ask.go) is latched, and its message was sent before this run began",
        ),
        (
            ["latched", "/go"],
            [("std_msgs/Empty", "std_msgs/Bool, qos: {durability: volatile}")],
            "",
        ),
        (
            ["joints", "arm=q1,q2@50"],
            [("init: home", "init: home, qos: {durability: transient_local}")],
            "the quality of service of /joint_states (a.R.arm.q) does not match",
        ),
        (
            ["joints", "arm=q1,q2@50"],
            [("[q1, q2]", "[q1, q9]")],
            "/joint_states has no joint q9: it has q1, q2 (a.R.arm.q)",
        ),
        (
            ["joints", "arm=j1,j2@50"],
            [],
            "/joint_states (a.R.arm.q) has none of the joints q1, q2: it has j1, j2",
        ),
    ],
    ids=["type", "latched", "volatile", "qos", "joint", "joints"],
)
def test_what_is_wrong_is_named_though_no_message_is_awaited(
    arm: Start,
    spec: Spec,
    others: list[str],
    changed: list[tuple[str, str]],
    said: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    arm(*others, program="nodes.py")
    path = spec(("wait: 20 s", f"wait: {SHORT}"), *changed, name="event")
    assert main(["run", str(path), "--duration", "1"]) == (2 if said else 0)
    assert said in capfd.readouterr().err


def test_another_type_that_comes_later_is_warned_of(
    arm: Start, spec: Spec, capfd: pytest.CaptureFixture[str]
) -> None:
    arm("asker", STATE, "/go", "Bool", program="nodes.py")
    assert main(["run", str(spec(name="event")), "--duration", "5"]) == 0
    said = "/go (a.R.ask.go) is published as std_msgs/msg/Bool, not as std_msgs/msg/Empty"
    assert capfd.readouterr().err.count(f"warning: {said}") == 1


def test_the_name_of_an_action_can_be_replaced(arm: Start, spec: Spec) -> None:
    server = arm("server", "/other", "succeed", "succeed", program="nodes.py")
    names = ["--ros-args", "-r", "/grasp:=/other"]
    assert main(["run", str(spec(name="retry")), "--cycles", "1", *names]) == 0
    assert "succeed 200" in end(server)


SLOW_AND_FAST = ["arm=q1,q2,q3@50", "gripper=f4,lamp5@4"]


def test_two_robots_of_one_specification_have_namespaces(arm: Start, spec: Spec) -> None:
    names = ("joint_states", "position_controller/commands", "ft_sensor/wrench")
    path, runs = spec(("topic: /", "topic: ")), []
    for side in ("left", "right"):
        arm("--ros-args", *(f for n in names for f in ("-r", f"/{n}:=/{side}/{n}")))
        command = [sys.executable, "-m", "specc", "run", str(path), "--cycles", "1", "--ros-args"]
        runs.append(subprocess.Popen([*command, "-r", f"__ns:=/{side}"]))
    assert [run.wait(timeout=60) for run in runs] == [0, 0]


def test_a_topic_that_nobody_reads_is_not_waited_for(arm: Start, spec: Spec) -> None:
    arm("asker", STATE, "/go", "Bool", program="nodes.py")
    unread = ("      arm: {y:", '      other: {y: {mode: "optional[text]"}}\n      arm: {y:')
    bound = ("  bind:\n", "  bind:\n    a.R.other.mode: {topic: /other, type: std_msgs/String}\n")
    assert main(["run", str(spec(unread, bound, name="event")), "--duration", "1"]) == 0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("-r", "nothing"), "--ros-args -r nothing: "),
        (("--duration", "1"), "--ros-args --duration 1: "),
        (("-p", "payload:=3"), "--set gives constants their values"),
        (("-r", "/ft_sensor/wrench:=/lost"), "nobody publishes /lost (irp.R.s.F)"),
    ],
)
def test_what_ros_cannot_use_is_named(
    arm: Start, spec: Spec, given: tuple[str, ...], said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    arm()
    path = spec(("wait: 5 s", f"wait: {SHORT}"))
    assert main(["run", str(path), "--duration", "1", "--ros-args", *given]) == 2
    assert said in "".join(capfd.readouterr())


def test_joints_of_several_publishers_are_one_element(arm: Start, spec: Spec) -> None:
    arm("joints", *SLOW_AND_FAST, program="nodes.py")
    assert main(["run", str(spec(name="joined")), "--cycles", "1"]) == 0


def test_joints_are_grouped_by_their_publishers(arm: Start, ros: str, tmp_path: Path) -> None:
    robot = arm("joints", "arm_driver=q1,q2,q3@100", "gripper_driver=f4@100", program="nodes.py")
    path = tmp_path / "robot.yaml"
    assert main(["init", "--ros2", str(path), "--python", ros, "--wait", "4"]) == 0
    text = path.read_text(encoding="utf-8")
    bind = data(text)["plant"]["bind"]
    assert {name: how.get("joints") for name, how in bind.items()} == {
        "robot.E.arm.q": ["q1", "q2", "q3"],
        "robot.E.arm.q_d": None,
        "robot.R.f4.q": ["f4"],
    }
    path.write_text(unhurried(text), encoding="utf-8")
    assert main(["run", str(path), "--cycles", "1"]) == 0
    assert "commanded" not in end(robot)


def test_a_publisher_of_some_joints_that_is_lost_is_named(
    arm: Start, spec: Spec, capfd: pytest.CaptureFixture[str]
) -> None:
    fast, slow = SLOW_AND_FAST
    arm("joints", fast, f"{slow}x8", program="nodes.py")
    path = spec(
        ("max_gap: 5 s", "max_gap: 1 s"), ("elapsed > 1[s]", "elapsed > 60[s]"), name="joined"
    )
    assert main(["run", str(path), "--cycles", "1"]) in (1, 2)
    assert "has had no message with joint f4 for" in "".join(capfd.readouterr())


SIMULATED = ("wait: 5 s", "wait: 20 s, use_sim_time: true")


def test_the_pace_is_that_of_the_simulation(arm: Start, spec: Spec) -> None:
    simulation = arm("--clock", "--pace", "0.25", "--pause", "10")
    assert main(["run", str(spec(SIMULATED)), "--duration", "1"]) == 0
    assert float(end(simulation).split()[-1]) >= 100.0 + 1.0


def test_a_simulation_that_is_reset_ends_the_run(
    arm: Start, spec: Spec, capfd: pytest.CaptureFixture[str]
) -> None:
    arm("--clock", "--jump", "100")
    assert main(["run", str(spec(SIMULATED)), "--duration", "60"]) == 1
    assert "/clock jumped back from 10" in "".join(capfd.readouterr())


def test_a_run_can_be_ended_while_the_simulation_stands_still(arm: Start, spec: Spec) -> None:
    simulation = arm("--clock", "--pause", "1", "--rate", "20")
    command = [sys.executable, "-m", "specc", "run", str(spec(SIMULATED)), "--duration", "9"]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    assert says(simulation, "commanded")
    run.send_signal(signal.SIGINT)
    run.communicate(timeout=60)
    assert run.returncode == 130


def test_what_is_published_can_be_watched(arm: Start, spec: Spec) -> None:
    arm()
    wanted = {
        "/irp/irp/m/y/c/q_c": "std_msgs/Float64MultiArray",
        "/irp/irp/s/y/c/F": "geometry_msgs/WrenchStamped",
        "/irp/irp/c": "std_msgs/String!",
        "/irp/changes": "std_msgs/String",
    }
    listener = arm(*(f"{topic}={kind}" for topic, kind in wanted.items()), program="listen.py")
    path = spec(("plant:\n", "plant:\n  publish: [irp.c, irp.m.y.c.q_c]\n"))
    more = ["--publish", "irp.s.y.c.F", "--duration", "4"]
    assert main(["run", str(path), *more]) == 0
    told: dict[str, list[Any]] = {topic: [] for topic in wanted}
    for line in end(listener).splitlines():
        topic, data = json.loads(line)
        told[topic].append(data)
    assert told["/irp/irp/c"][-1] == "S1"
    assert len(told["/irp/irp/m/y/c/q_c"][-1]) == 3
    assert set(told["/irp/irp/s/y/c/F"]) == {"ft_frame"}
    assert {json.loads(change)["to"] for change in told["/irp/changes"]} <= {"S0", "S1"}


@pytest.mark.parametrize("how", ["ended", "killed"])
def test_a_goal_is_cancelled_when_the_run_ends(arm: Start, spec: Spec, how: str) -> None:
    never = ("x.g.step >= 3", "x.g.step >= 1000")
    gripper, path = arm(), spec(never, ("wanted: 60", "wanted: 10000"), name="gripper")
    command = [sys.executable, "-m", "specc", "run", str(path), "--duration"]
    if how == "ended":
        subprocess.run([*command, "3"], check=True, capture_output=True, timeout=60)
    else:
        with subprocess.Popen([*command, "60"], stdout=subprocess.DEVNULL) as run:
            assert says(gripper, "began 10000")
            run.kill()
    assert says(gripper, "canceled")


def test_a_goal_without_a_safe_output_is_cancelled_when_the_run_ends(
    arm: Start, spec: Spec
) -> None:
    server = arm("server", "/grasp", "wait", program="nodes.py")
    path = spec(('{type: "optional[int]", safe: None}', '"optional[int]"'), name="gripper")
    assert main(["run", str(path), "--duration", "2"]) == 0
    assert says(server, "canceled")


def test_a_goal_that_is_not_accepted_yet_does_not_outlive_the_run(arm: Start, spec: Spec) -> None:
    gripper, path = arm("--thinks", "0.4"), spec(("wanted: 4", "wanted: 10000"), name="gripper")
    assert main(["run", str(path), "--duration", "0.3"]) == 0
    assert says(gripper, "canceled")


def test_the_end_of_the_server_of_a_goal_is_named(arm: Start, spec: Spec) -> None:
    gripper, path = arm(), spec(("wanted: 4", "wanted: 10000"), name="gripper")
    command = [sys.executable, "-m", "specc", "run", str(path), "--duration", "60"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as run:
        assert says(gripper, "began 10000")
        end(gripper)
        out, _ = run.communicate(timeout=60)
    assert run.returncode == 1
    assert out.count("\nfault ") == 1
    assert "fault device hand.E.g.grip: nobody serves the action /grasp any more" in out


@pytest.mark.parametrize("when", ["now", "later"])
def test_another_node_that_commands_is_warned_of(
    arm: Start, spec: Spec, when: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    arm()
    arm("commander", COMMANDS, when, program="nodes.py")
    report = tmp_path / "report.json"
    path = spec(("wait: 5 s", f"wait: {LONG}"))
    assert main(["run", str(path), "--duration", "5", "--report", str(report)]) == 0
    out, err = capfd.readouterr()
    said = f"/teleop can send on {COMMANDS}, too, which commands irp.E.m.q_d"
    assert err.count(f"warning: {said}") == 1
    assert f"not alone: {said}" in out
    (told,) = json.loads(report.read_text())["other_commanders"].values()
    assert (told["topic"], told["nodes"]) == (COMMANDS, ["/teleop"])
    assert told["first_s"] > 0.0 or when == "now"


SHORT, LONG = "4 s", "20 s"
"""Of waiting: what is not there is missed after the short one; the rest comes in the long one."""
WRENCH, COMMANDS = "topic: /ft_sensor/wrench", "/position_controller/commands"


@pytest.mark.parametrize(
    ("changed", "options", "said", "wait"),
    [
        (
            [],
            ["--frame", "tool0"],
            "`header.frame_id` is `tool0`, where `ft_frame` is declared",
            LONG,
        ),
        (
            [("frames: {S: ft_frame}", "frames: {}"), ("WrenchStamped", "Wrench")],
            [],
            "/ft_sensor/wrench (irp.R.s.F) is published as geometry_msgs/msg/WrenchStamped, not as "
            "geometry_msgs/msg/Wrench",
            SHORT,
        ),
        ([("/joint_states", "/joints")], [], "nobody publishes /joints (irp.E.m.q_m)", SHORT),
        (
            [("/joint_states", "/ft_sensor/wrench")],
            [],
            "/ft_sensor/wrench (irp.R.s.F) cannot be opened as geometry_msgs/WrenchStamped",
            SHORT,
        ),
        ([(COMMANDS, "/commands")], [], "nobody reads /commands (irp.E.m.q_d)", SHORT),
        (
            [(WRENCH, f"qos: {{durability: transient_local}}, {WRENCH}")],
            [],
            "the quality of service of /ft_sensor/wrench (irp.R.s.F) does not match",
            SHORT,
        ),
        (
            [("q1, q2, q3]", "q1, q2, q9]")],
            [],
            "/joint_states has no joint q9: it has q3, q1, q2",
            LONG,
        ),
        (
            [],
            ["--joints", "j1,j2,j3"],
            "/joint_states (irp.E.m.q_m) has none of the joints q1, q2, q3: it has j1, j2, j3",
            SHORT,
        ),
        (
            [("max_gap: 5 s", "max_gap: 500 ms")],
            ["--silent-after", "300"],
            "irp.E.m.q_m: there has been no sample for",
            LONG,
        ),
        ([], ["--behind", "90"], "is stamped 9", LONG),
        (
            [("wrench, type: geometry_msgs/WrenchStamped", "wrench, type: geometry_msgs/Wrong")],
            [],
            "no value is known to stand in messages of type geometry_msgs/Wrong",
            SHORT,
        ),
    ],
    ids=[
        "frame",
        "type",
        "missing",
        "twice",
        "unread",
        "qos",
        "joint",
        "joints",
        "silent",
        "clock",
        "unknown",
    ],
)
def test_what_is_wrong_is_named(
    arm: Start,
    spec: Spec,
    changed: list[tuple[str, str]],
    options: list[str],
    said: str,
    wait: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    arm(*options)
    path = spec(("wait: 5 s", f"wait: {wait}"), *changed)
    assert main(["run", str(path), "--duration", "20"]) in (1, 2)
    assert said in "".join(capfd.readouterr())


def test_every_message_survives_as_plain_data(ros: str) -> None:
    program = [ros, str(HERE / "every_message.py")]
    done = subprocess.run(program, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout.split()[0]) > 60


def test_a_python_without_ros_says_what_to_do(
    spec: Spec, ros: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = spec((f"python: {ros}", "python: python3"))
    assert main(["run", str(path)]) == 2
    err = capfd.readouterr().err
    assert "has no rclpy" in err and "specc_runtime" not in err
    assert main(["init", str(path.parent), "--ros2"]) == 2
    assert "has no rclpy" in capfd.readouterr().err
