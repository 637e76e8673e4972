"""Values and messages are the same things in two forms; what a message lacks is named."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.builtins import pose
from specc_runtime.contracts import as_depth, as_pose, as_rgb, as_vector
from specc_runtime.plants.errors import PlantError
from specc_runtime.ros2.binding import Ros2, Ros2Topic
from specc_runtime.ros2.messages import Message, message_of, quaternion_xyzw, value_of

from specc.analysis.ros2_messages import CALL_MESSAGES, JOINTS, MESSAGES

numbers = st.floats(-1e3, 1e3)
three = st.tuples(numbers, numbers, numbers)
turns = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 1e-3)
FRAMES = (("header.frame_id", "base_link"), ("child_frame_id", "tool0"))


def topic(shape: Any, path: str = "", **more: Any) -> Ros2Topic:
    return Ros2Topic("a.E.m.q", "/q", "package/Type", shape, path, **more)


@given(three, turns)
def test_a_rotation_becomes_its_quaternion(
    origin: tuple[float, ...], turn: tuple[float, ...]
) -> None:
    X = pose(np.array(origin), np.array(turn))
    q = quaternion_xyzw(X[:3, :3])
    assert q[3] >= 0
    np.testing.assert_allclose(np.linalg.norm(q), 1.0, rtol=1e-12)
    np.testing.assert_allclose(pose(np.array(origin), q), X, atol=1e-12)


@pytest.mark.parametrize("shape", ["pose", "transform"])
@given(three, turns)
def test_poses_come_back(shape: str, origin: tuple[float, ...], turn: tuple[float, ...]) -> None:
    X = pose(np.array(origin), np.array(turn))
    stamped = topic(shape, "pose.pose", frames=FRAMES)
    message = message_of(stamped, X)
    assert message["header"] == {"frame_id": "base_link"}
    assert message["child_frame_id"] == "tool0"
    np.testing.assert_allclose(as_pose(value_of(stamped, message)), X, atol=1e-12)


@pytest.mark.parametrize("shape", ["twist", "wrench"])
@given(three, three)
def test_spatial_vectors_come_back(
    shape: str, linear: tuple[float, ...], angular: tuple[float, ...]
) -> None:
    both = np.array((*linear, *angular))
    assert (value_of(topic(shape), message_of(topic(shape), both)) == both).all()


@given(st.permutations(["q1", "q2", "q3", "gripper"]), three)
def test_joints_are_found_by_their_names(names: list[str], angles: tuple[float, ...]) -> None:
    joints = topic("joints", "position", joints=("q1", "q2", "q3"))
    at = {"gripper": 9.0, **message_numbers(joints, angles)}
    message = {"name": names, "position": [at[name] for name in names]}
    assert as_vector(3)(value_of(joints, message)).tolist() == list(angles)


def message_numbers(joints: Ros2Topic, angles: tuple[float, ...]) -> dict[str, float]:
    message = message_of(joints, np.array(angles))
    return dict(zip(message["name"], message["position"], strict=True))


def test_one_joint_is_a_number() -> None:
    finger = topic("joints", "effort", joints=("finger",), is_number=True)
    message = message_of(finger, 2.5)
    assert message == {"name": ["finger"], "effort": [2.5]}
    assert value_of(finger, message) == 2.5


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"name": ["q1"], "position": [0.0]}, "/q has no joint q2: it has q1"),
        ({"name": ["q1", "q2"], "position": []}, "/q has 0 numbers in `position` for 2 joints"),
    ],
)
def test_missing_joints_are_named(message: dict[str, object], said: str) -> None:
    with pytest.raises(PlantError, match=said):
        value_of(topic("joints", "position", joints=("q1", "q2")), message)


def test_another_frame_is_named_with_the_declared_one() -> None:
    wrench = topic("wrench", "wrench", frames=(("header.frame_id", "ft_frame"),))
    message = message_of(wrench, np.ones(6))
    assert value_of(wrench, message).tolist() == [1.0] * 6
    message["header"]["frame_id"] = "tool0"
    with pytest.raises(PlantError, match=r"`header.frame_id` is `tool0`, where `ft_frame`"):
        value_of(wrench, message)


def test_no_orientation_is_refused() -> None:
    message = {"position": dict.fromkeys("xyz", 0.0), "orientation": dict.fromkeys("xyzw", 0.0)}
    with pytest.raises(PlantError, match="length 0 is no orientation"):
        value_of(topic("pose"), message)


def test_images_come_back_in_any_order_of_colours() -> None:
    image = np.random.default_rng(1).integers(0, 256, (4, 6, 3), np.uint8)
    message = message_of(topic("image"), image)
    assert (as_rgb(4, 6)(value_of(topic("image"), message)) == image).all()
    swapped = message | {"encoding": "bgr8", "data": image[:, :, ::-1].tobytes()}
    assert (value_of(topic("image"), swapped) == image).all()
    padded = np.zeros((4, 20), np.uint8)
    padded[:, :18] = image.reshape(4, 18)
    rows = message | {"step": 20, "data": padded.tobytes()}
    assert (value_of(topic("image"), rows) == image).all()


def test_depths_come_in_millimetres_and_metres() -> None:
    depth = np.linspace(0, 3, 24, dtype=np.float32).reshape(4, 6)
    message = message_of(topic("depth"), depth)
    assert (as_depth(4, 6)(value_of(topic("depth"), message)) == depth).all()
    unread = depth.copy()
    unread[0, 0] = np.nan
    assert value_of(topic("depth"), message | {"data": unread.tobytes()})[0, 0] == 0
    millimetres = (1000 * depth).astype(">u2")
    coded = {"encoding": "16UC1", "is_bigendian": 1, "step": 12, "data": millimetres.tobytes()}
    np.testing.assert_allclose(value_of(topic("depth"), message | coded), depth, atol=1e-3)


@pytest.mark.parametrize("wrong", [{"encoding": "mono8"}, {"step": 17}, {"data": b"few"}])
def test_what_is_no_image_is_refused(wrong: dict[str, object]) -> None:
    message = message_of(topic("image"), np.zeros((4, 6, 3), np.uint8))
    with pytest.raises(PlantError, match="image"):
        value_of(topic("image"), message | wrong)


def test_a_function_sees_attributes_and_gives_fields() -> None:
    whole = topic("message")
    message = value_of(whole, {"header": {"stamp": {"sec": 3}}, "parts": [{"id": 7}]})
    assert isinstance(message, Message)
    assert (message.header.stamp.sec, message.parts[0].id) == (3, 7)
    with pytest.raises(AttributeError, match="no field 'other': it has header, parts"):
        _ = message.other
    made = message_of(whole, {"data": np.arange(3.0), "id": np.int64(2), "raw": np.zeros(2, "u1")})
    assert made == {"data": [0.0, 1.0, 2.0], "id": 2, "raw": b"\0\0"}
    assert [type(item) for item in made["data"]] == [float] * 3


def test_the_runtime_knows_every_shape_of_the_compiler() -> None:
    from specc_runtime.ros2.messages import _SHAPES

    tables = (*MESSAGES.values(), *CALL_MESSAGES.values())
    shapes = {part.shape for parts in tables for part in parts} | {"records"}
    assert shapes == {*_SHAPES, *JOINTS}


def test_the_node_is_told_in_plain_data() -> None:
    named = topic("joints", "position", joints=("q1",), qos=(("depth", 2),))
    config = Ros2("/cell/irp", (named,), wait_s=2.0).config
    assert (config["node"], config["namespace"]) == ("irp", "/cell")
    assert config["topics"][0]["qos"] == {"depth": 2}
    assert "frames" not in config["topics"][0]
