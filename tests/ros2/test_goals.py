"""Which goal what an action reports belongs to, as a run sees it."""

from __future__ import annotations

from typing import Any

import pytest
from specc_runtime.plant import LOST, NO_SAMPLE, Sample
from specc_runtime.ros2.binding import Ros2Topic
from specc_runtime.ros2.goals import Goals

PARTS = ("status", "feedback", "result", "goal")


class Rig:
    """The goals of an action, and a node that has reported something of one."""

    def __init__(self) -> None:
        self.goals = Goals(Ros2Topic(p, "/grasp", "c/Grasp", "scalar", part=p) for p in PARTS)
        self.reported: dict[str, Any] = {}
        self.report(0, status="none", feedback=None, result=None)

    def report(self, number: int, **values: Any) -> None:
        self.reported |= {part: (number, value) for part, value in values.items()}

    def _of_node(self, name: str) -> Any:
        value = self.reported.pop(name, None)
        return NO_SAMPLE if value is None else Sample(value, 0.01)

    def __getitem__(self, part: str) -> Any:
        """The value of the next sample; `NO_SAMPLE` if there is nothing new."""
        sample = self.goals.sample(part, self._of_node)
        return sample if sample is NO_SAMPLE else sample.value


@pytest.fixture
def rig() -> Rig:
    made = Rig()
    assert [made[part] for part in PARTS] == ["none", None, None, None]
    return made


def test_a_new_goal_is_the_first_value_after_none_or_a_different_one(rig: Rig) -> None:
    wanted = (None, 1, 1, 2, 1, None, None, 1, None)
    assert [rig.goals.take(goal) for goal in wanted] == [0, 1, 1, 2, 3, 3, 3, 4, 4]


def test_the_status_is_none_until_the_goal_is_answered(rig: Rig) -> None:
    rig.goals.take(1)
    rig.report(1, status="rejected")  # before the first sample
    assert [rig["status"], rig["goal"], rig["feedback"], rig["result"]] == ["none", 1, None, None]
    assert [rig["status"], rig["status"], rig["goal"]] == ["rejected", NO_SAMPLE, NO_SAMPLE]


def test_what_comes_of_an_earlier_goal_is_not_given(rig: Rig) -> None:
    rig.goals.take(1)
    rig.report(1, status="executing")
    assert [rig["status"], rig["status"]] == ["none", "executing"]
    rig.goals.take(2)
    rig.report(1, status="succeeded", feedback=9, result=9)
    assert [rig["status"], rig["status"], rig["goal"]] == ["none", NO_SAMPLE, 2]
    assert [rig["feedback"], rig["feedback"]] == [None, NO_SAMPLE]
    assert [rig["result"], rig["result"]] == [None, NO_SAMPLE]
    rig.report(2, status="accepted")
    assert rig["status"] == "accepted"


def test_none_after_the_end_of_a_goal_leaves_no_status(rig: Rig) -> None:
    rig.goals.take(1)
    rig.report(1, status="aborted", result=3)
    assert [rig["status"], rig["status"]] == ["none", "aborted"]
    assert [rig["result"], rig["result"]] == [None, 3]
    rig.goals.take(None)
    assert [rig["status"], rig["goal"], rig["result"]] == ["none", None, NO_SAMPLE]


def test_a_goal_that_is_cancelled_tells_its_end(rig: Rig) -> None:
    rig.goals.take(1)
    rig.report(1, status="executing")
    assert [rig["status"], rig["status"], rig["goal"]] == ["none", "executing", 1]
    for _ in range(2):
        rig.goals.take(None)
    rig.report(1, status="canceling")
    assert [rig["status"], rig["goal"]] == ["canceling", None]
    rig.report(1, status="canceled")
    assert rig["status"] == "canceled"
    rig.goals.take(None)
    assert rig["status"] is NO_SAMPLE
    rig.goals.take(1)
    assert [rig["status"], rig["goal"]] == ["none", 1]


def test_a_goal_that_is_lost_has_ended(rig: Rig) -> None:
    rig.goals.take(1)
    rig.report(1, status=LOST)
    assert [rig["status"], rig["status"]] == ["none", LOST]
    rig.goals.take(None)
    assert rig["status"] == "none"
