"""`specc init --ros2`: what is written for a graph of ROS 2 validates, and commands nothing."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.plants.errors import PlantError
from specc_runtime.ros2 import looking

from specc.cli import main
from specc.pipeline import check_spec
from specc.source import real_path
from specc.tools.fmt import format_text
from specc.tools.starting.ros2 import LISTENED, Devices, graph_from, proposal
from tests.docs.examples import data, examples
from tests.seeds import Seeds, blocks, every

DOCUMENT = Path(__file__).parents[2] / "docs" / "ros2.md"
HZ_10 = {"count": 20, "mean_s": 0.1002, "longest_s": 0.11}
HEADER = {"header.frame_id": "ft_frame"}
Data = dict[str, Any]


def published(name: str, type_: str, **more: Any) -> Data:
    more = {"message": HEADER, "count": 1, **more}
    return {"name": name, "types": [type_], "publishers": ["/driver"], **more}


def read(name: str, type_: str, **more: Any) -> Data:
    return {"name": name, "types": [type_], "readers": ["/controller"], **more}


def joints(name: str, *names: str, **more: Any) -> Data:
    message = {"joints": list(names), "position": True, "velocity": False, "effort": False}
    return published(name, "sensor_msgs/msg/JointState", message=message, **more)


def graph(*topics: Data, actions: Any = (), more: int = 0) -> Data:
    return {"topics": list(topics), "actions": list(actions), "more": more}


def proposed(found: Data) -> tuple[str, list[str]]:
    """The text for a graph, and the codes of what is found in it; empty if there is nothing."""
    devices = Devices(graph_from(found))
    if not devices.every:
        return "", []
    text = proposal(devices, "robot", "robot", "specc init --ros2")
    path = "/nowhere/robot.yaml"
    result = check_spec(path, texts={real_path(path): text})
    return text, [each.code for each in result.diagnostics]


def bound(found: Data) -> Data:
    """Bindings, by names of elements."""
    text, codes = proposed(found)
    assert set(codes) <= {"W0413"}
    bind: Data = data(text)["plant"]["bind"]
    return bind


COMMANDS = read("/forward_position_controller/commands", "std_msgs/msg/Float64MultiArray")
RRBOT = graph(
    published("/clock_of_somebody", "builtin_interfaces/msg/Time"),
    COMMANDS,
    joints("/joint_states", "joint2", "joint1", **HZ_10),
    published("/parameter_events", "rcl_interfaces/msg/ParameterEvent"),
    published("/robot_description", "std_msgs/msg/String", published_kept=True),
    published("/rosout", "rcl_interfaces/msg/Log"),
    published("/tf", "tf2_msgs/msg/TFMessage"),
)


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Data:
    """A graph that is found wherever somebody looks; the working directory is empty."""
    found = dict(RRBOT)
    monkeypatch.setattr(looking, "graph_of", lambda *_: found)
    monkeypatch.chdir(tmp_path)
    return found


def test_the_plant_of_the_documentation_comes_out(seen: Data) -> None:
    example = next(each.text for each in examples(DOCUMENT) if not each.context)
    command = ["init", "--ros2", "rrbot", "--agent", "rr", "--python", "/usr/bin/python3"]
    assert main(command) == 0
    text = Path("rrbot.yaml").read_text()
    assert data(text)["plant"] == data(example)["plant"]
    assert "There is tf" in text
    assert "/clock_of_somebody (builtin_interfaces/msg/Time)" in text
    assert main(["validate", "rrbot.yaml"]) == main(["fmt", "--check", "rrbot.yaml"]) == 0
    assert main(["build", "rrbot.yaml"]) == 0


def test_files_have_the_names_that_are_given(
    seen: Data, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", "--ros2"]) == 0
    assert main(["init", "cell", "--ros2", "my-arm.yaml"]) == 0
    assert data(Path("cell/my-arm.yaml").read_text())["system"] == "my_arm"
    before = Path("robot.yaml").read_bytes()
    assert main(["init", "--ros2", "robot.yaml"]) == 2
    assert "robot.yaml exists already" in capsys.readouterr().err
    assert Path("robot.yaml").read_bytes() == before


@pytest.mark.parametrize(
    ("said", "written"),
    [
        ("ros/bin/python3", "{here}/ros/bin/python3"),
        ("../py", "{above}/py"),
        ("python3", "python3"),
    ],
)
def test_the_python_is_found_from_anywhere(said: str, written: str, seen: Data) -> None:
    """A name is looked for on the path, a place is that of the one who calls."""
    assert main(["init", "cell", "--ros2", "arm", "--python", said]) == 0
    python = data(Path("cell/arm.yaml").read_text())["plant"]["ros2"]["python"]
    assert python == written.format(here=Path.cwd(), above=Path.cwd().parent)


def test_nothing_is_written_without_topics(
    seen: Data, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any) -> Data:
        raise PlantError("python3 has no rclpy")

    seen.update(graph())
    assert main(["init", "--ros2"]) == 2
    assert "start the robot, or look longer with --wait" in capsys.readouterr().err
    monkeypatch.setattr(looking, "graph_of", refuse)
    assert main(["init", "--ros2"]) == 2
    assert "python3 has no rclpy; nothing was written" in capsys.readouterr().err
    assert not list(Path.cwd().iterdir())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--wait", "3"], "--wait is about ROS 2"),
        (["--ros2", "--group", "a=b"], "--group is about a model"),
        (["--ros2", "--agent", "E"], "nothing can be called 'E'"),
        (["--agent", "e"], "--agent is about a model or ROS 2"),
    ],
)
def test_options_that_do_not_go_together_are_named(
    seen: Data, options: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["init", *options]) == 2
    assert said in capsys.readouterr().err
    assert not list(Path.cwd().iterdir())


def test_topics_become_devices() -> None:
    image = {**HEADER, "height": 4, "width": 6, "encoding": "rgb8"}
    odometry = {"header.frame_id": "odom", "child_frame_id": "base_link"}
    found = bound(
        graph(
            published("/cam/info", "sensor_msgs/msg/CameraInfo"),
            published("/cam/raw", "sensor_msgs/msg/Image", message=image, **HZ_10),
            read("/cmd_vel", "geometry_msgs/msg/TwistStamped", read_kept=True),
            published("/levels", "std_msgs/msg/Float32MultiArray", message={"size": 3}),
            published("/map_pose", "geometry_msgs/msg/PoseStamped", published_kept=True, **HZ_10),
            published("/odom", "nav_msgs/msg/Odometry", message=odometry),
            read("/lamp", "std_msgs/msg/Bool"),
            read("/look_at", "geometry_msgs/msg/PointStamped"),
            actions=[("/hand/grasp", ["control_msgs/action/GripperCommand"])],
        )
    )
    kept = {"durability": "transient_local"}
    assert found.keys() == {
        *("robot.R.cam.K", "robot.R.cam.I", "robot.E.cmd_vel.V_d", "robot.R.levels.v"),
        *("robot.R.map_pose.T", "robot.R.odom.T", "robot.R.odom.V", "robot.E.lamp.value_d"),
        *("robot.E.look_at.p_d", "robot.E.hand_grasp.status"),
    }
    assert found["robot.R.cam.I"]["max_gap"] == "500 ms"
    assert found["robot.E.cmd_vel.V_d"]["qos"] == found["robot.R.map_pose.T"]["qos"] == kept
    assert "max_gap" not in found["robot.R.map_pose.T"]
    assert found["robot.E.hand_grasp.status"]["type"] == "control_msgs/GripperCommand"


def test_commands_go_with_the_joints_of_their_namespace() -> None:
    found = bound(
        graph(
            joints("/left/joint_states", "a", "b"),
            joints("/right/joint_states", "elbow", "base", "wrist"),
            read("/left/velocity_controller/commands", "std_msgs/msg/Float64MultiArray"),
            read("/right/effort_controller/commands", "std_msgs/msg/Float64MultiArray"),
            read("/right/position_controller/commands", "sensor_msgs/msg/JointState"),
        )
    )
    assert found.keys() == {
        *("robot.E.left_arm.q", "robot.E.left_arm.dq_d"),
        *("robot.E.right_arm.q", "robot.E.right_arm.q_d"),
    }
    assert found["robot.E.right_arm.q_d"]["joints"] == ["elbow", "base", "wrist"]


def part(*names: str, **more: Any) -> Data:
    """What came of joint states with these joints, for tests of topics with several publishers."""
    whole = joints("", *names, **more)
    return {key: whole[key] for key in ("message", "count", *more)}


def test_joints_are_grouped_by_the_messages_that_they_come_in() -> None:
    states = joints("/joint_states", "finger", **HZ_10)
    states["publishers"] = ["/arm_driver", "/gripper_driver"]
    states["parts"] = [
        part("finger", **HZ_10),
        part("joint1", "joint2", "joint3", **HZ_10 | {"mean_s": 0.01, "longest_s": 0.011}),
        part("joint2", "lift"),
    ]
    text, codes = proposed(graph(states, COMMANDS))
    assert codes == ["W0413"]
    bind = data(text)["plant"]["bind"]
    assert {name: how.get("joints") for name, how in bind.items()} == {
        "robot.E.arm.q": ["joint1", "joint2", "joint3"],
        "robot.E.arm.q_d": None,
        "robot.R.finger.q": ["finger"],
    }
    assert [how.get("max_gap") for how in bind.values()] == ["100 ms", None, "500 ms"]
    said = " ".join(text.replace("\n#", " ").split())
    assert "Left out: its joints also come in other messages." in said
    assert "Joints of one message: joint2, lift." in said


@pytest.mark.parametrize(
    ("age_s", "limits"),
    [(None, ["1 s", "1 s"]), (0.3, ["2 s", "2 s"]), (-40.0, ["", ""]), ("x", ["", ""])],
)
def test_the_age_of_what_is_read_is_limited(age_s: Any, limits: list[str]) -> None:
    """For 20 Hz: `max_gap` of 500 ms, twice the age of a message that came, and periods."""
    state = joints("/joint_states", "a", "b", count=9, mean_s=0.05, longest_s=0.06)
    if age_s is not None:
        state["message"]["age_s"] = age_s
    text, codes = proposed(graph(state, COMMANDS))
    assert codes == ["W0413"]
    agent = data(text)["agents"]["robot"]
    of_device, of_control = (
        agent["virtual_effectors"]["arm"]["x"]["E"]["q"],
        agent["control"]["x"]["arm"]["q"],
    )
    found = [q["max_age"] if isinstance(q, dict) else "" for q in (of_device, of_control)]
    assert found == limits


def test_a_joint_is_commanded_once() -> None:
    text, codes = proposed(
        graph(
            joints("/left/joint_states", "a", "b"),
            joints("/joint_states", "a", "b", "lift"),
            read("/left/velocity_controller/commands", "std_msgs/msg/Float64MultiArray"),
            read("/lift_controller/commands", "std_msgs/msg/Float64MultiArray"),
        )
    )
    assert codes == ["W0413"]
    found = data(text)["plant"]["bind"]
    assert found.keys() == {
        *("robot.E.left_arm.q", "robot.E.left_arm.dq_d", "robot.R.joint_states.q"),
    }
    assert "which joints it moves is not known: others command some of the nearest" in text


@pytest.mark.parametrize(
    ("topic", "said"),
    [
        (published("/x", "cell_msgs/msg/Lamp"), "bound with a function under `through`"),
        (published("/x", "std_msgs/msg/Float64MultiArray", count=0), "no message came"),
        (COMMANDS, "nothing says how many numbers it takes"),
        (read("/x", "sensor_msgs/msg/Imu"), "its messages have several values"),
        (joints("/x", "a{1..9}"), "joints have unusual names"),
        (joints("/x", "a", "a"), "a name twice"),
        (published("/x__y", "std_msgs/msg/Bool"), "its name is none of ROS 2"),
        (published("/x", "std_msgs/msg/Bool", types=["a/msg/B", "a/msg/C"]), "do not agree"),
        (
            published("/x", "geometry_msgs/msg/WrenchStamped", message={"header.frame_id": "[x"}),
            "its frame has an unusual name",
        ),
    ],
)
def test_what_is_left_out_has_a_reason(topic: Data, said: str) -> None:
    text, codes = proposed(graph(published("/there", "std_msgs/msg/Bool"), topic, more=7))
    assert codes == []
    assert said in " ".join(text.replace("\n#", " ").split())
    assert "7 more topics" in text


def test_a_topic_without_a_message_is_none_until_one_comes() -> None:
    silent = {"count": 0, "message": {}}
    text, codes = proposed(
        graph(
            published("/go", "std_msgs/msg/Empty", **silent),
            published("/mode", "std_msgs/msg/String", **silent),
        )
    )
    assert codes == []
    receptors = data(text)["agents"]["robot"]["real_receptors"]
    assert [device["y"] for device in receptors.values()] == [
        {"came": "optional[bool]"},
        {"value": "optional[text]"},
    ]


def test_names_of_others_say_nothing_to_specc() -> None:
    name = "/a # specc: ignore[W0413] x\n\x1b[2J\u202e"
    text, codes = proposed(graph(COMMANDS | {"readers": [name]}, joints("/j", "a")))
    assert codes == ["W0413"]
    assert text.isascii() and text.replace("\n", "").isprintable()
    assert "specc: ignore" not in text


def test_time_is_that_of_a_simulation() -> None:
    topics = (published("/clock", "rosgraph_msgs/msg/Clock"), joints("/j", "a", **HZ_10))
    plant = data(proposed(graph(*topics))[0])["plant"]
    assert plant["ros2"]["use_sim_time"] is True
    assert "max_gap" not in plant["bind"]["robot.R.j.q"]


# Whatever there is.

WORDS = ["joint_states", "commands", "a", "q1", "E", "x", "class", "ü", "a b", "9", "", "{i}", "on"]
TYPES = [*LISTENED, "cell_msgs/msg/Lamp", "tf2_msgs/msg/TFMessage", "rosgraph_msgs/msg/Clock", "x"]


def word(of: random.Random) -> str:
    return of.choice(
        [*WORDS, of.choice(WORDS), str(of.randrange(99)), chr(of.randrange(1, 0x3000))]
    )


def path(of: random.Random) -> str:
    if of.random() < 0.7:
        return "/" + "/".join(of.choice(["a", "q1", "cmd", "c"]) for _ in range(of.randrange(1, 5)))
    return "/" + "/".join(word(of) for _ in range(of.randrange(1, 4)))


def message(of: random.Random) -> Data:
    names = [word(of) for _ in range(of.choice([0, 1, 2, 7, 199]))]
    return {
        "header.frame_id": of.choice(["", "/base", "tool0", word(of)]),
        "child_frame_id": of.choice(["", "base", word(of)]),
        "age_s": of.choice([0.0, 1e-3, 0.2, -0.5, 1e9]),
        "encoding": of.choice(["rgb8", "16UC1", "32FC1", "bayer_rggb8", word(of)]),
        "height": of.choice([0, 3, 480, 2**32 - 1]),
        "width": of.choice([1, 640]),
        "size": of.choice([0, 1, 6, 10**9]),
        "joints": names if of.random() < 0.5 else [f"j{n}" for n in range(len(names))],
        **{name: of.random() < 0.6 for name in ("position", "velocity", "effort")},
    }


def topic_of(of: random.Random) -> Data:
    def nodes() -> list[str]:
        return [path(of) for _ in range(of.choice([0, 0, 1, 5]))]

    return {
        "name": path(of),
        "types": [of.choice(TYPES) for _ in range(of.choice([1, 1, 1, 1, 2]))],
        "publishers": nodes(),
        "readers": nodes(),
        "published_kept": of.random() < 0.2,
        "read_kept": of.random() < 0.2,
        "message": message(of) if of.random() < 0.8 else {},
        "parts": [{"message": message(of)} for _ in range(of.choice([0, 0, 2, 3]))],
        "count": of.choice([0, 1, 3, 200]),
        "mean_s": of.choice([0.0, 0.001, 0.1, 1e4]) * of.random(),
        "longest_s": of.choice([0.0, 0.1, 1e5]) * of.random(),
    }


@pytest.mark.parametrize("seeds", blocks(range(12), long=40, each=40))
def test_whatever_there_is_validates(seeds: Seeds) -> None:
    for seed in seeds:
        of = random.Random(seed)
        topics = {t["name"]: t for t in (topic_of(of) for _ in range(of.choice([3, 12, 40])))}
        actions = [(path(of), ["cell_msgs/action/Grasp"]) for _ in range(of.randrange(3))]
        found = json.loads(json.dumps(graph(*topics.values(), actions=actions)))
        text, codes = proposed(found)
        # Each command, and nothing else, lacks somebody who writes it.
        bind = data(text)["plant"]["bind"] if text else {}
        assert codes == ["W0413" for name in bind if name.endswith("_d")], text
        assert not text or format_text(text) == text


@pytest.mark.long
def test_as_many_topics_as_are_told_of_validate() -> None:
    topics = [published(f"/t{n}/imu", "sensor_msgs/msg/Imu") for n in range(200)]
    text, codes = proposed(graph(*topics))
    assert codes == []
    assert "there are 100 devices already" in text


@pytest.mark.parametrize("type_", every(4, [name.replace("/msg/", "/") for name in LISTENED]))
def test_every_message_of_the_table_is_bound(type_: str) -> None:
    told = {**HEADER, "child_frame_id": "e", "height": 2, "width": 2, "size": 2, "encoding": "rgb8"}
    told |= {"joints": ["a"], "position": True}
    full = type_.replace("/", "/msg/")
    assert bound(graph(published("/x", full, message=told)))
