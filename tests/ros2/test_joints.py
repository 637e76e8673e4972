"""Joint states whose messages have some of the joints each."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from specc_runtime.hosting.devices import DeviceError
from specc_runtime.ros2.host.joints import JointNumbers


def message(*names: str, n: int = 9) -> SimpleNamespace:
    """Joint states, each joint being where its name says; `n` numbers at most."""
    return SimpleNamespace(name=list(names), position=[float(name[1:]) for name in names][:n])


@pytest.fixture
def joints() -> JointNumbers:
    return JointNumbers("/joint_states", ["q1", "q2", "q3"], "position", 0.5)


def test_the_newest_number_of_each_joint_is_kept_and_the_oldest_tells_the_age(
    joints: JointNumbers,
) -> None:
    assert joints.take(message("q3", "x7"), 1.0, 1.1)
    joints.take(message("y8"), 1.05, 1.15)
    assert joints.missing == ["q1", "q2"] and joints.known == ["q3", "x7", "y8"]
    assert joints.take(message("q2", "q1"), 1.2, 1.25)
    assert joints.missing == [] and joints.is_changed
    assert joints.joined(1.3) == ({"name": ["q1", "q2", "q3"], "position": [1.0, 2.0, 3.0]}, 1.0)
    assert not joints.is_changed
    joints.take(message("q3"), 1.4, 1.5)
    assert joints.joined(1.5)[1] == 1.2


def test_a_joint_that_is_silent_is_named_though_others_go_on(joints: JointNumbers) -> None:
    joints.take(message("q1", "q2", "q3"), 1.0, 1.0)
    joints.take(message("q1", "q3"), 1.5, 1.5)
    joints.joined(1.5)
    joints.take(message("q1", "q3"), 1.6, 1.6)
    with pytest.raises(DeviceError, match=r"no message with joint q2 for 0.6 s, `max_gap` is 0.5"):
        joints.joined(1.6)


def test_the_loss_of_a_joint_is_a_value_where_that_is_answered() -> None:
    joints = JointNumbers("/joint_states", ["q1", "q2"], "position", 0.5, is_answered=True)
    joints.take(message("q1", "q2"), 1.0, 1.0)
    joints.take(message("q1"), 1.6, 1.6)
    assert joints.joined(1.6) == (None, 1.6)
    joints.take(message("q2"), 1.7, 1.7)
    assert joints.joined(1.7) == ({"name": ["q1", "q2"], "position": [1.0, 2.0]}, 1.6)


def test_a_message_without_the_numbers_of_its_joints_is_not_taken(joints: JointNumbers) -> None:
    assert joints.take(message("q1", "x7", n=1), 1.0, 1.0)
    assert not joints.take(message("q1", "q2", n=1), 1.0, 1.0)
    assert joints.missing == ["q2", "q3"]
