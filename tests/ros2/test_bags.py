"""Bags of ROS 2: what runs write, and what specifications do with what others have recorded."""

from __future__ import annotations

import json
import math
import re
import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.writer import Writer
from rosbags.rosbag2 import StoragePlugin
from specc_runtime.options import UsageError
from specc_runtime.ros2.bags.comparing import Commands
from specc_runtime.ros2.bags.names import TopicNames
from specc_runtime.ros2.bags.transforms import TransformTree
from specc_runtime.ros2.bags.types import NoMessage, Types
from specc_runtime.ros2.binding import Ros2Topic

from specc.cli import main
from tests.commands import ROOT, specc
from tests.ros2.bags import Written, header, read, write
from tests.ros2.conftest import HERE, Start

pytestmark = pytest.mark.no_replay("a bag is no recording")
JOINTS, WRENCHES, COMMANDS = "/joint_states", "/ft_sensor/wrench", "/position_controller/commands"
STATES, WRENCH, ARRAY = (
    "sensor_msgs/msg/JointState",
    "geometry_msgs/msg/WrenchStamped",
    "std_msgs/msg/Float64MultiArray",
)
ARM = HERE / "arm.yaml"


def driven(until_s: float = 2.0, frame: str = "ft_frame") -> Iterator[Written]:
    """What an arm tells at 100 Hz, its joints in two messages: it is there after 1 s."""
    for number in range(round(until_s * 100)):
        at_s = number / 100
        share = min(at_s, 1.0)
        # Nothing is awaited any more from 0.1 s on.
        stamped = header(at_s - 0.003)
        yield at_s, JOINTS, STATES, {"header": stamped, "name": ["q3"], "position": [1.0 * share]}
        if number >= 10:
            q1q2 = {"name": ["q2", "q1"], "position": [0.2 * share, 0.3 * share]}
            yield at_s, JOINTS, STATES, {"header": stamped, **q1q2}
        wrench = {"force": {"z": -1.5}}
        yield at_s, WRENCHES, WRENCH, {"header": header(at_s - 0.003, frame), "wrench": wrench}


def without(topic: str) -> list[Written]:
    return [each for each in driven(0.5) if each[1] != topic]


@pytest.mark.parametrize("storage", StoragePlugin)
def test_a_specification_runs_on_a_bag_and_says_why(storage: StoragePlugin, tmp_path: Path) -> None:
    bag, out = write(tmp_path / "bag", driven(), storage), tmp_path / "out.mcap"
    done = specc("replay", ARM, "--bag", bag, "--record", out)
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    assert lines[:3] == [f"0.000 s irp.{name}" for name in ("m: S0", "s: S0", "c: S0")]
    # 0.1 s after it began there is a command, 0.9 s after it the arm is there.
    assert lines[3] == "0.100 s irp.m: S0 terminal commanded -> S1"
    assert re.fullmatch(r"(0\.9|1\.0)00 s irp\.c: S0 terminal always -> S1", lines[4])
    assert lines[5:] == [f"{COMMANDS}: the bag has no commands"]
    why = specc("why", f"{out}@1.5", "irp.c", "--spec", ARM)
    assert "by S0 terminal always -> S1" in why.stdout


def test_a_bag_is_not_written_over(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", driven(0.3))
    for record in (bag / "bag.mcap", bag / "other.mcap"):
        done = specc("replay", ARM, "--bag", bag, "--record", record)
        assert done.returncode == 2 and "the run reads" in done.stderr
    file = next(bag.glob("*.mcap"))
    done = specc("replay", ARM, "--bag", file, "--record", file)
    assert done.returncode == 2 and "the run reads" in done.stderr
    assert specc("replay", ARM, "--bag", bag).returncode == 0


def test_ages_are_those_of_stamps(tmp_path: Path) -> None:
    """One of four joints comes every 0.3 s: its age is that of all."""
    told: list[Written] = []
    for n in range(150):
        fast = {"name": ["q1", "q2", "q3"], "position": [1.0, 2.0, 3.0]}
        told.append((n / 50, JOINTS, STATES, fast | {"header": header(n / 50 - 0.01)}))
        if n % 15 == 0:
            slow = {"name": ["f4"], "position": [4.0], "header": header(n / 50 - 0.01)}
            told.append((n / 50, JOINTS, STATES, slow))
    path, out = HERE / "joined.yaml", tmp_path / "out.mcap"
    done = specc("replay", path, "--bag", write(tmp_path / "bag", told), "--record", out)
    assert (done.returncode, done.stderr) == (0, "")
    ages = [step["age"]["arm.q"] for step in steps(out, "/a.c") if "arm" in step["x"]]
    # As soon as it may be seen, and until the next message may.
    assert min(ages) == pytest.approx(0.03, abs=1e-6)
    assert max(ages) == pytest.approx(0.31, abs=1e-6)


def test_events_of_a_bag_come_once_each(tmp_path: Path) -> None:
    told: list[Written] = [(n / 5, "/go", "std_msgs/msg/Empty", {}) for n in range(3)]
    done = specc("replay", HERE / "event.yaml", "--bag", write(tmp_path / "two", told[:2]))
    assert done.returncode == 0 and "a.c: S0 terminal" not in done.stdout
    told.append((1.0, "/mode", "std_msgs/msg/String", {"data": "fast"}))
    done = specc("replay", HERE / "event.yaml", "--bag", write(tmp_path / "three", told))
    assert done.stdout.count("a.c: S0 terminal always -> S1") == 1


def test_silence_in_a_bag_is_answered(tmp_path: Path) -> None:
    told: list[Written] = []
    for n in range(200):
        if not 100 <= n < 150 or n == 120:  # one of two joints does not end it
            names, turned = (["q1"], [0.5]) if n == 120 else (["q1", "q2"], [0.5, 1.5])
            joints = {"name": names, "position": turned, "header": header(n / 50)}
            told.append((n / 50, JOINTS, STATES, joints))
        if not 100 <= n < 150:
            told.append((n / 50, "/load", "std_msgs/msg/Float64", {"data": 2.0}))
    done = specc("replay", HERE / "losses.yaml", "--bag", write(tmp_path / "bag", told))
    assert (done.returncode, done.stderr) == (0, "")
    entered = [to for who, to in replayed(done.stdout) if who == "a.c"]
    assert entered == ["slow", "fast", "slow", "fast"]


LATE = """
specc: 1.3
system: late
agents:
  a:
    real_receptors: {r: {y: {load: "optional[real]"}}}
    virtual_receptors: {r: {rate: 20 Hz, through: identity}}
    control:
      rate: 20 Hz
      x: {r: {load: "optional[real]"}}
      conditions:
        initial: {late: "elapsed >= 1[s]"}
        terminal: {over: "(present(x.r.load) and x.r.load is not None) or elapsed >= 1[s]"}
      behaviours: {wait: {terminal: over}, end: {terminal: never}}
      states: {S0: wait, got: end, gave_up: end}
      initial_state: S0
      transitions: [[S0, terminal, late, gave_up], [S0, terminal, otherwise, got]]
plant:
  ros2: {node: late, wait: 20 s}
  bind: {a.R.r.load: {topic: /load, type: std_msgs/Float64}}
task: {cycle: {of: a.c, from: S0, to: got}}
"""


@pytest.mark.parametrize("storage", StoragePlugin)
def test_a_replay_begins_when_the_run_did(storage: StoragePlugin, tmp_path: Path) -> None:
    path = tmp_path / "late.yaml"
    path.write_text(LATE, encoding="utf-8")
    text, number = "std_msgs/msg/String", "std_msgs/msg/Float64"
    change = {"data": json.dumps({"subsystem": "a.c", "from": None, "to": "S0", "time_s": 0.0})}
    load: Written = (2.0, "/load", number, {"data": 1.0})
    others: list[Written] = [(0.0, "/camera", text, {}), load]
    ran: list[Written] = [(1.5, "/late/changes", text, change), (1.0, "/load", number, {}), load]
    for name, told, to in (
        ("any", others, "late -> gave_up"),
        ("own", ran, "otherwise -> got"),
        ("silent", [ran[0], (3.0, "/camera", text, {})], "late -> gave_up"),
    ):
        done = specc("replay", path, "--bag", write(tmp_path / name, told, storage))
        assert (done.returncode, done.stderr) == (0, "")
        assert to in done.stdout


def test_a_replay_changes_constants_and_the_panel_as_the_bag_says(tmp_path: Path) -> None:
    path = tmp_path / "late.yaml"
    text = LATE.replace(
        "agents:", 'constants: {most: {is: "1[s]", range: [0, 9], live: true}}\nagents:'
    )
    text = text.replace('"elapsed >= 1[s]"', '"x.r.go"').replace(">= 1[s]", ">= most")
    text = text.replace('load: "optional[real]"}', 'load: "optional[real]", go: bool}')
    text = text.replace("bind: {", "bind: {a.R.r.go: {panel: switch}, ")
    path.write_text(text, encoding="utf-8")
    changes: list[dict[str, Any]] = [
        {"subsystem": "a.c", "from": None, "to": "S0", "time_s": 0.0},
        {"constant": "most", "value": 2.0, "by": "page", "time_s": 0.0},
        {"element": "a.R.r.go", "value": True, "by": "keys", "time_s": 1.5},
        {"constant": "most", "value": 9.5, "by": "keys", "time_s": 1.6},
        {"constant": "most", "value": 3.0, "by": "task", "time_s": 1.6},
        {"subsystem": "a.c", "from": "S0", "to": "gave_up", "time_s": 2.0},
    ]
    told: list[Written] = [
        (each["time_s"], "/late/changes", "std_msgs/msg/String", {"data": json.dumps(each)})
        for each in changes
    ]
    done = specc("replay", path, "--bag", write(tmp_path / "bag", told))
    assert done.returncode == 0
    assert "2.000 s a.c: S0 terminal late -> gave_up" in done.stdout
    assert done.stderr.count("\n") == 1 and "most is not 9.5 s" in done.stderr


def test_only_a_bag_without_any_message_has_a_gap(tmp_path: Path) -> None:
    path = tmp_path / "late.yaml"
    path.write_text(LATE.replace("20 Hz", "1 Hz"), encoding="utf-8")
    number = "std_msgs/msg/Float64"
    told: list[Written] = [(at_s, "/load", number, {}) for at_s in (0.0, 1.0, 4001.0)]
    others: list[Written] = [(at_s, "/other", number, {}) for at_s in (2000.0, 6000.0)]
    assert specc("replay", path, "--bag", write(tmp_path / "idle", told + others)).returncode == 0
    done = specc("replay", path, "--bag", write(tmp_path / "gap", told))
    assert done.returncode == 1 and "has no message for 4000 s" in done.stderr


def test_messages_that_come_too_late_are_told(tmp_path: Path) -> None:
    file = tmp_path / "back.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"bool data\n")
        channel = writer.register_channel("/e_stop", "cdr", schema)
        for at_s in (0, 1, 2, 3, 4, 5, 1, 1, 6):
            writer.add_message(channel, at_s * 10**9, b"\0\1\0\0\0", 0)
        writer.finish()
    done = specc("replay", HERE / "latched.yaml", "--bag", file)
    assert done.returncode == 0
    assert "2 messages are up to 2 s before those of earlier ones" in done.stderr


def test_a_recording_of_specc_is_no_bag_and_a_bag_of_it_has_any_name(tmp_path: Path) -> None:
    path, bag = tmp_path / "late.yaml", tmp_path / "a.bag"
    path.write_text(LATE, encoding="utf-8")
    told: list[Written] = [(0.0, "/load", "std_msgs/msg/Float64", {}), (1.0, "/other", STATES, {})]
    recorded = tmp_path / "a.mcap"
    command = "replay", path, "--bag", write(tmp_path / "bag", told)
    assert specc(*command, "--record", recorded).returncode == 0
    done = specc("replay", path, "--bag", recorded)
    assert done.returncode == 2 and f"specc replay {recorded} --spec SPEC" in done.stderr
    next((tmp_path / "bag").glob("*.mcap")).rename(bag)
    assert specc("replay", path, "--bag", bag).returncode == 0
    # What others have recorded is not replaced.
    before = bag.read_bytes()
    done = specc("run", ROOT / "specs/conveyor_gate.yaml", "--duration", "0.1", "--record", bag)
    assert done.returncode == 2 and "what is there is no recording" in done.stderr
    assert bag.read_bytes() == before


def steps(recording: Path, topic: str) -> list[Any]:
    with recording.open("rb") as stream:
        messages = make_reader(stream).iter_messages(topics=[topic])
        return [json.loads(message.data) for _, _, message in messages]


def test_one_file_of_a_bag_is_a_bag(tmp_path: Path) -> None:
    file = next(write(tmp_path / "bag", driven(0.3)).glob("*.mcap"))
    done = specc("replay", ARM, "--bag", file, "--until", "0.05")
    assert done.returncode == 0 and "S1" not in done.stdout


@pytest.mark.parametrize(
    ("messages", "said"),
    [
        (
            without(WRENCHES),
            "has no message of /ft_sensor/wrench (irp.R.s.F): it has /joint_states [sensor_msgs",
        ),
        (
            [each for each in driven(0.5) if each[3].get("name") != ["q3"]],
            "/joint_states with joint q3 (irp.E.m.q_m)",
        ),
        (
            [*without(WRENCHES), (0.2, WRENCHES, "std_msgs/msg/String", {"data": "x"})],
            "/ft_sensor/wrench is std_msgs/msg/String in ",
        ),
        ([], "is empty"),
    ],
)
def test_a_bag_that_does_not_fit_is_refused(
    messages: list[Written], said: str, tmp_path: Path
) -> None:
    done = specc("replay", ARM, "--bag", write(tmp_path / "bag", messages))
    assert (done.returncode, done.stdout) == (2, "")
    assert said in done.stderr and done.stderr.count("\n") == 1


def test_a_fault_of_a_device_is_one_in_a_bag(tmp_path: Path) -> None:
    done = specc("replay", ARM, "--bag", write(tmp_path / "bag", driven(0.3, frame="tool0")))
    assert done.returncode == 1
    assert "`header.frame_id` is `tool0`, where `ft_frame` is declared" in done.stderr


def test_what_is_no_bag_is_refused(tmp_path: Path) -> None:
    (tmp_path / "none.mcap").write_bytes(b"")
    (tmp_path / "none.db3").write_bytes(b"x" * 100)
    (tmp_path / "folder").mkdir()
    for name in ("none.mcap", "none.db3", "folder", "gone", "a\0b"):
        done = specc("replay", ARM, "--bag", tmp_path / name)
        assert done.returncode == 2 and done.stderr.startswith("error: --bag: "), done.stderr
        assert "Traceback" not in done.stderr
    gate = ROOT / "specs/conveyor_gate.yaml"
    assert "not behind ROS 2" in specc("replay", gate, "--bag", tmp_path).stderr


@pytest.mark.parametrize("storage", StoragePlugin)
def test_bags_that_are_cut_or_damaged_leave_no_traceback(
    storage: StoragePlugin, tmp_path: Path
) -> None:
    suffix = "mcap" if storage is StoragePlugin.MCAP else "db3"
    whole = next(write(tmp_path / "bag", driven(0.4), storage).glob(f"*.{suffix}")).read_bytes()
    file, out = tmp_path / f"part.{suffix}", tmp_path / "out.mcap"
    file.write_bytes(whole)
    assert specc("replay", ARM, "--bag", file, "--record", out).returncode == 0
    count = len(steps(out, "/irp.m"))
    for number in range(1, 12):
        file.write_bytes(whole[: len(whole) * number // 12])
        cut = specc("replay", ARM, "--bag", file, "--record", out)
        assert cut.returncode in (0, 1, 2) and "Traceback" not in cut.stderr
        # Nobody is silent but where all messages are before the cut.
        assert cut.stderr or len(steps(out, "/irp.m")) == count, number
        at = len(whole) * number // 12
        file.write_bytes(whole[:at] + b"\xff" * 20 + whole[at + 20 :])
        damaged = specc("replay", ARM, "--bag", file)
        assert damaged.returncode in (0, 1, 2) and "Traceback" not in damaged.stderr


def test_a_bag_that_unpacks_to_far_more_than_its_size_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bomb.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        schema = writer.register_schema(STATES, "ros2msg", b"")
        channel = writer.register_channel(JOINTS, "cdr", schema)
        writer.add_message(channel, 0, b"\0\1\0\0" + bytes(200_000_000), 0)
        writer.finish()
    assert file.stat().st_size < 100_000
    done = specc("replay", ARM, "--bag", file)
    assert done.returncode == 2 and "far more than its size" in done.stderr


@pytest.mark.parametrize(
    "sql",
    [
        "CREATE VIEW schema AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x FROM n) "
        "SELECT x AS schema_version FROM n",
        "CREATE TABLE other(x INTEGER, y TEXT AS (hex(zeroblob(1000000000))))",
    ],
)
def test_a_database_that_computes_is_refused(sql: str, tmp_path: Path) -> None:
    file = next(write(tmp_path / "bag", driven(0.2), StoragePlugin.SQLITE3).glob("*.db3"))
    with closing(sqlite3.connect(file)) as database:
        database.execute("DROP TABLE schema")
        database.execute(sql)
        database.commit()
    done = specc("replay", ARM, "--bag", file)
    assert done.returncode == 2 and "it computes what it has" in done.stderr


def test_values_of_other_types_in_a_database_are_refused(tmp_path: Path) -> None:
    file = next(write(tmp_path / "bag", driven(0.2), StoragePlugin.SQLITE3).glob("*.db3"))
    for column, value in (("data", 10**12), ("data", "x"), ("timestamp", "x")):
        with closing(sqlite3.connect(file)) as database:
            database.execute(f"UPDATE messages SET {column} = ?", (value,))
            database.commit()
        done = specc("replay", ARM, "--bag", file)
        assert (done.returncode, done.stdout) == (2, "") and "Traceback" not in done.stderr


def test_a_function_gets_messages_of_a_type_that_the_bag_defines(tmp_path: Path) -> None:
    text = (HERE / "latched.yaml").read_text(encoding="utf-8")
    bound = "{topic: /lamp, type: cell_msgs/Lamp, through: 'cell:shines'}"
    path = tmp_path / "lamp.yaml"
    path.write_text(re.sub(r"\{topic: /e_stop.*\}\}", f"{bound}}}", text), encoding="utf-8")
    (tmp_path / "cell.py").write_text("def shines(message):\n    return message.level > 2.0\n")
    told = [(n / 10, "/lamp", "cell_msgs/msg/Lamp", {"level": 1.0 * n}) for n in range(8)]
    kind = {"cell_msgs/msg/Lamp": "float64 level\nuint8[] data\n"}
    done = specc("replay", path, "--bag", write(tmp_path / "bag", told, definitions=kind))
    assert (done.returncode, done.stderr) == (0, "")
    forged = {"cell_msgs/msg/Lamp": "float64[100000] level\nuint8[] data\n"}
    told = [(0.1, "/lamp", "cell_msgs/msg/Lamp", {})]
    done = specc("replay", path, "--bag", write(tmp_path / "forged", told, definitions=forged))
    assert done.returncode == 2 and "more than 10000 parts" in done.stderr


def test_messages_are_as_the_distribution_that_has_recorded_them_has_them(tmp_path: Path) -> None:
    file = tmp_path / "old.mcap"
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start("ros2")
        old = writer.register_schema("std_msgs/msg/Bool", "ros2msg", b"uint32 before\nbool data\n")
        channel = writer.register_channel("/e_stop", "cdr", old)
        for n in range(8):
            data = b"\0\1\0\0" + struct.pack("<I?", 7, n == 1)
            writer.add_message(channel, round(n * 1e8), data, 0)
        writer.finish()
    out = tmp_path / "out.mcap"
    done = specc("replay", HERE / "latched.yaml", "--bag", file, "--record", out)
    assert (done.returncode, done.stderr) == (0, "")
    assert [step["x"]["R"]["on"] for step in steps(out, "/a.stop")] == [n == 1 for n in range(8)]


def link(parent: str, child: str, at_s: float, z: float) -> dict[str, Any]:
    turn = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    transform = {"translation": {"x": 0.0, "y": 0.0, "z": z}, "rotation": turn}
    return {"header": header(at_s, parent), "child_frame_id": child, "transform": transform}


def test_transforms_of_a_bag_are_poses(tmp_path: Path) -> None:
    kind = "tf2_msgs/msg/TFMessage"
    told: list[Written] = [
        (0.0, "/tf_static", kind, {"transforms": [link("flange", "tool0", 0.0, 0.05)]})
    ]
    for n in range(40):
        moved = link("base_link", "flange", n / 20, 0.2 - n / 200)
        told.append((n / 20, "/tf", kind, {"transforms": [moved]}))
    done = specc("replay", HERE / "poses.yaml", "--bag", write(tmp_path / "bag", told))
    assert done.returncode == 0
    assert "a.c: S0 terminal always -> S1" in done.stdout


def test_the_tree_of_transforms_has_ways_up_and_down() -> None:
    tree = TransformTree()
    links = [link("base", "arm", 3.0, 1.0), link("base", "eye", 2.0, 0.2)]
    tree.take({"transforms": links}, is_static=False)
    found = tree.between("eye", "arm")
    assert found is not None
    fields, stamp_s = found
    assert fields["translation"]["z"] == pytest.approx(0.8)
    assert stamp_s == pytest.approx(header(2.0)["stamp"]["sec"])
    assert tree.between("eye", "moon") is None
    tree.take({"transforms": [link("eye", "base", 2.0, 0.0)]}, is_static=True)  # round in a circle
    tree.between("eye", "arm")


def test_simulated_time_is_that_of_the_clock_in_a_bag(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    text = ARM.read_text(encoding="utf-8")
    path.write_text(text.replace("node: irp,", "node: irp, use_sim_time: true,"), encoding="utf-8")

    def at(number: int) -> dict[str, int]:
        sec, nanosec = divmod(number * 20_000_000, 10**9)
        return {"sec": sec, "nanosec": nanosec}

    def slow(last: int) -> Iterator[Written]:
        """At a tenth of the pace of the machine's clock."""
        for n in range(200):
            yield n / 5, "/clock", "rosgraph_msgs/msg/Clock", {"clock": at(n if n < 150 else last)}
        for at_s, topic, kind, fields in driven():
            stamp = at(round(at_s * 50))
            told = fields | {"header": fields["header"] | {"stamp": stamp}}
            yield at_s * 10 + 0.001, topic, kind, told

    done = specc("replay", path, "--bag", write(tmp_path / "bag", slow(150)))
    assert re.search(r"(0\.9|1\.0)00 s irp\.c: S0 terminal always -> S1", done.stdout), done.stderr
    done = specc("replay", path, "--bag", write(tmp_path / "reset", slow(10)))
    assert done.returncode == 1 and "/clock jumps back from 2.98 s to 0.2 s" in done.stderr
    timeless = (each for each in slow(150) if each[1] != "/clock")
    done = specc("replay", path, "--bag", write(tmp_path / "timeless", timeless))
    assert (done.returncode, done.stdout) == (2, "") and "has no /clock" in done.stderr


def test_commands_of_a_bag_are_compared(tmp_path: Path) -> None:
    told = [*driven(0.5), (0.3, COMMANDS, ARRAY, {"data": [0.0, 0.0, 0.0]})]
    done = specc("replay", ARM, "--bag", write(tmp_path / "bag", told))
    assert f"{COMMANDS} differs first at" in done.stdout
    assert "the bag has {'data': [0.0, 0.0, 0.0]}, now" in done.stdout
    told[-1] = (0.3, COMMANDS, "std_msgs/msg/String", {})
    done = specc("replay", ARM, "--bag", write(tmp_path / "other", told))
    assert f"{COMMANDS}: not compared, it is std_msgs/msg/String in the bag" in done.stdout


def test_commands_are_counted() -> None:
    topic = Ros2Topic("a.E.v", "/v", "geometry_msgs/Twist", "message", commanded=True)
    types, has = Types(), {"/v": "geometry_msgs/msg/Twist"}

    def difference(had: list[tuple[float, float]], now: list[float]) -> str:
        commands = Commands({"/v": topic}, types)
        for time_s, x in had:
            fields = {"linear": {"x": x, "y": 1.0, "z": 0.0}, "angular": {}}
            commands.had("/v", partial(decoded, fields), time_s)
            if time_s == 1.0:
                commands.begin(1.0)
        for x in now:
            commands.now("a.E.v", {"linear": {"x": x, "y": 1.0}}, 2.0)
        return "".join(commands.differences(has))

    def decoded(fields: dict[str, Any]) -> dict[str, Any]:
        return types.decoded(has["/v"], types.encoded(has["/v"], fields))

    had = [(0.0, 3.0), (0.9, 0.0), (1.0, 0.0), (2.0, 1.0)]
    assert difference(had, [0.0, 0.0, 1.0]) == "/v: the same commands as in the bag (2)"
    assert difference(had, [0.0]) == "/v: the same until command 1; the bag has 1 more"
    assert difference(had, [0.0, 1.0, 0.0]) == "/v: the same until command 2; the replay has 1 more"
    assert "the bag has {'linear': {'x': 0.0}}, now {'linear': {'x': 5.0}}" in difference(
        had, [5.0]
    )
    many = difference(had, [float(n % 2) for n in range(10_004)])
    assert many.endswith("the replay has 10002 more (no more than 10000 wait to be compared)")


def test_topics_of_a_bag_may_have_other_names(tmp_path: Path) -> None:
    moved = [(at_s, f"/left{topic}", kind, told) for at_s, topic, kind, told in driven(0.4)]
    bag = write(tmp_path / "bag", moved)
    renamed = [part for t in (JOINTS, WRENCHES) for part in ("-r", f"{t}:=/left{t}")]
    done = specc("replay", ARM, "--bag", bag, "--ros-args", *renamed)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("given", "names"),
    [  # As a node of Jazzy resolves /a, q and ~/x.
        ("-r /a:=/b -r /a:=/c", "/b /q /irp/x"),
        ("-r irp:/a:=/b --remap other:q:=/c", "/b /q /irp/x"),
        ("-r __ns:=/l -r __ns:=/m -r q:=/w", "/a /w /l/irp/x"),
        ("-r irp:__node:=z -r z:/a:=/b -r irp:q:=/w", "/b /q /z/x"),
        ("-r q:=/w -r /q:=/v -p r:=1 --log-level debug", "/a /w /irp/x"),
    ],
)
def test_the_first_rule_for_a_node_wins(given: str, names: str) -> None:
    found = TopicNames("irp", given.split())
    assert " ".join(map(found.full, ("/a", "q", "~/x"))) == names


def test_names_are_those_of_ros() -> None:
    plain, given = (
        TopicNames("irp"),
        ["-r", "__ns:=/left", "-r", "state:=other", "--remap", "/a:=/b"],
    )
    moved = TopicNames("/cell/irp", given)
    for topic, wanted, replaced in (
        ("/a", "/a", "/b"),
        ("q", "/q", "/left/q"),
        ("~/x", "/irp/x", "/left/irp/x"),
        ("state", "/state", "/left/other"),
    ):
        assert (plain.full(topic), moved.full(topic)) == (wanted, replaced)
    assert TopicNames("irp", ["-p", "q:=1", "-r", "q:=r"]).full("q") == "/r"
    for wrong in ("-r a", "-r", "-r /a:=/b:=/c", "-r /irp:/a:=/b", "-r __ns:=left", "/a:=/b"):
        with pytest.raises(UsageError, match="OLD:=NEW"):
            TopicNames("irp", wrong.split())


def test_a_bag_has_no_parameters(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", driven(0.3))
    done = specc("replay", ARM, "--bag", bag, "--ros-args", "-p", "speed:=1.0")
    assert done.returncode == 2 and "--set" in done.stderr


def test_messages_are_what_they_were() -> None:
    types = Types()
    image = {"height": 1, "width": 2, "encoding": "mono8", "step": 2, "data": b"ab"}
    for name, fields in (
        ("sensor_msgs/msg/Image", image),
        ("sensor_msgs/msg/JointState", {"name": ["q"], "position": [0.5], "header": header(1.0)}),
        ("std_msgs/msg/Empty", {}),
        ("tf2_msgs/msg/TFMessage", {"transforms": [link("a", "b", 0.0, 1.0)]}),
    ):
        told = types.decoded(name, types.encoded(name, fields))
        assert types.decoded(name, types.encoded(name, told)) == told
        assert {key: told[key] for key in fields if key != "transforms"} == {
            key: value for key, value in fields.items() if key != "transforms"
        }
    odometry = {"pose": {"covariance": [1.0] * 36}, "child_frame_id": "base"}
    told = types.decoded(name := "nav_msgs/msg/Odometry", types.encoded(name, odometry))
    assert told["pose"]["covariance"] == [1.0] * 36 and told["child_frame_id"] == "base"
    # As rclpy serializes JointState(name=["a"], position=[0.5]).
    data = bytes.fromhex(
        "000100000000000000000000010000000000000001000000020000006100000001000000000000000000e03f"
        "00000000000000000000000000000000"
    )
    told = types.decoded("sensor_msgs/msg/JointState", data)
    assert (told["name"], told["position"], told["effort"]) == (["a"], [0.5], [])
    for name in ("sensor_msgs/msg/CameraInfo", "nav_msgs/msg/Odometry", "std_msgs/msg/String"):
        assert types.agrees(name, types.definition(name).decode())
    assert not types.agrees("std_msgs/msg/String", "int32 data\n")
    with pytest.raises(NoMessage):
        types.decoded("sensor_msgs/msg/JointState", b"\0\1\0\0" + b"\xff" * 40)
    with pytest.raises(NoMessage):
        types.learn("a/msg/B", "float64 level\nimport os\n")
    with pytest.raises(NoMessage):
        types.learn("a/msg/B", "B inside\n")


def test_a_run_that_is_not_behind_ros_is_a_bag_of_what_is_sent(tmp_path: Path) -> None:
    bag = tmp_path / "gate.mcap"
    gate = ROOT / "specs/conveyor_gate.yaml"
    done = specc("run", gate, "--duration", "6", "--record", bag, "--profile", "ros2")
    assert done.returncode == 0, done.stderr
    messages = read(bag)
    states = [m.data for topic, _, m in messages if topic == "/conveyor_gate/gate/c"]
    changes = [json.loads(m.data) for topic, _, m in messages if topic.endswith("/changes")]
    of_gate = [change for change in changes if change["subsystem"] == "gate.c"]
    assert [change["to"] for change in of_gate] == states and len(states) > 1
    assert of_gate[0]["from"] is None
    assert all(c["conditions"] and c["cause"] and "->" in c["transition"] for c in of_gate[1:])
    speeds = [m.data for topic, _, m in messages if topic == "/conveyor_gate/belt/drive/y/c/v"]
    assert len(speeds) == 600 and all(map(math.isfinite, speeds))
    # As a run leaves it that is killed.
    bag.write_bytes(bag.read_bytes()[: bag.stat().st_size // 2])
    assert specc("recover", bag).returncode == 0
    assert 0 < len(read(bag)) < len(messages)


def test_a_profile_needs_a_file(tmp_path: Path) -> None:
    gate = ROOT / "specs/conveyor_gate.yaml"
    done = specc("run", gate, "--profile", "ros2")
    assert done.returncode == 2 and "--record FILE.mcap" in done.stderr
    done = specc("replay", tmp_path / "a.mcap", "--record", tmp_path / "b.mcap")
    assert done.returncode == 2 and "--bag" in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("name", ["arm", "gripper", "follow", "nested"])
def test_a_bag_of_a_live_run_replays_to_its_states(
    name: str,
    arm: Start,
    spec: Callable[..., Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    others = {
        "follow": ("follower", "/arm_controller/joint_trajectory"),
        "nested": ("twice", "/twice"),
    }
    arm(*others[name], program="nodes.py") if name in others else arm()
    path, bag = spec(name=name), tmp_path / "live.mcap"
    watched = ["--publish", "irp.m.y.c.q_c"] if name == "arm" else []
    command = ["run", str(path), "--cycles", "1", "--record", str(bag), "--profile", "ros2"]
    assert main([*command, *watched]) == 0
    messages = read(bag)
    if name == "arm":
        assert "/irp/irp/m/y/c/q_c" in {topic for topic, _, _ in messages}
        assert {topic for topic, _, _ in messages} > {JOINTS, WRENCHES, COMMANDS}
        stamps = [m.header.stamp.sec for topic, _, m in messages if topic in (JOINTS, WRENCHES)]
        assert all(stamps)
    if name == "follow":
        way = next(m for topic, _, m in messages if topic == others[name][1])
        assert [each.time_from_start.nanosec for each in way.points] == [250_000_000, 500_000_000]
    capsys.readouterr()
    assert main(["replay", str(path), "--bag", str(bag)]) == 0
    out = capsys.readouterr().out
    assert replayed(out) == states(messages)
    times = [
        f"{json.loads(m.data)['time_s']:.3f}" for t, _, m in messages if t.endswith("/changes")
    ]
    assert re.findall(r"^([0-9.]+) s [\w.]+: ", out, re.MULTILINE) == times
    assert not re.search("differs|no commands|more", out)


def states(messages: list[tuple[str, int, Any]]) -> list[tuple[str, str]]:
    """The states of subsystems in the order in which they were entered, by a bag."""
    changes = [json.loads(m.data) for topic, _, m in messages if topic.endswith("/changes")]
    return [(change["subsystem"], change["to"]) for change in changes]


def replayed(out: str) -> list[tuple[str, str]]:
    """The same, by what is printed."""
    return re.findall(r"^[0-9.]+ s ([\w.]+): (?:.* -> )?(\w+)$", out, re.MULTILINE)


@pytest.mark.long
def test_calls_of_a_live_run_are_in_its_bag(
    arm: Start, spec: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A service is served with the help of another one."""
    arm("switch", "/lamp", "succeed", "fail", program="nodes.py")
    arm("presser", "/lamp/press", "2", program="nodes.py")
    path, bag = spec(name="lamp"), tmp_path / "lamp.mcap"
    options = ["--duration", "4", "--record", str(bag), "--profile", "ros2"]
    assert main(["run", str(path), *options]) == 0
    assert states(read(bag)).count(("a.c", "on")) == 1
    capsys.readouterr()
    assert main(["replay", str(path), "--bag", str(bag)]) == 0
    assert replayed(capsys.readouterr().out) == states(read(bag))


@pytest.mark.long
def test_a_bag_has_messages_of_types_that_only_ros_knows(
    arm: Start, spec: Callable[..., Path], tmp_path: Path
) -> None:
    arm("lamp", "/lamp", program="nodes.py")
    (tmp_path / "lamps.py").write_text(
        "def shines(message):\n    return message.basic_types_value.float64_value > 2.0\n"
    )
    old = "{topic: /e_stop, type: std_msgs/Bool, qos: {durability: transient_local}}"
    bound = "{topic: /lamp, type: test_msgs/Nested, through: 'lamps:shines'}"
    path, bag = spec((old, bound), name="latched"), tmp_path / "lamp.mcap"
    done = specc("run", path, "--cycles", "1", "--record", bag, "--profile", "ros2")
    assert done.returncode == 0 and "JSON" not in done.stderr
    lamps = [message for topic, _, message in read(bag) if topic == "/lamp"]
    assert lamps and all(lamp.basic_types_value.float64_value == 3.0 for lamp in lamps)
    assert specc("replay", path, "--bag", bag).returncode == 0


@pytest.mark.long
def test_changes_of_constants_of_a_live_run_are_in_its_bag(
    arm: Start, spec: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, bag = spec(name="tuned"), tmp_path / "tuned.mcap"
    arm("tuner", "/tuned", "set v 0.5", "until tries 5", "set v 1.0", program="nodes.py")
    options = ["--cycle-limit", "60", "--record", str(bag), "--profile", "ros2"]
    assert main(["run", str(path), *options]) == 0
    changes = [json.loads(m.data) for topic, _, m in read(bag) if topic.endswith("/changes")]
    made = [(each["constant"], each["value"], each["by"]) for each in changes if "by" in each]
    assert made == [("v", 0.5, "parameter"), ("tries", 5, "task"), ("v", 1.0, "parameter")]
    capsys.readouterr()
    assert main(["replay", str(path), "--bag", str(bag)]) == 0
    out, err = capsys.readouterr()
    assert (out.count("the same commands as in the bag"), err) == (2, "")
    assert "S0 terminal always -> S1" in out
