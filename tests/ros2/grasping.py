"""Functions of `through` for the gripper of the simulated arm: an action that counts its steps."""

from __future__ import annotations

from typing import Any, NamedTuple


def goal(steps: int | None) -> dict[str, int]:
    """The goal of closing in so many steps."""
    assert steps is not None, "None is no goal"
    return {"order": steps}


def last(message: Any) -> int:
    """The last number of a feedback or a result."""
    return int(message.sequence[-1])


def feedback(steps: int) -> dict[str, list[int]]:
    """The feedback of so many steps."""
    return {"sequence": [steps]}


class Width(NamedTuple):
    """Some fields of `test_msgs/BasicTypes`."""

    float64_value: float
    bool_value: bool


class Time(NamedTuple):
    """A field of `test_msgs/Builtins`, s."""

    duration_value: float


class Goal(NamedTuple):
    """Some fields of the goal of `test_msgs/NestedMessage`."""

    nested_field: Width
    nested_field_no_pkg: Time


def whole(width: float, time: float) -> Goal:
    """The goal of that width, m, and time, s."""
    return Goal(Width(width, True), Time(time))


def milliseconds(point: Any) -> dict[str, int]:
    """The goal of a posture, of which a server that counts steps learns how long it may take."""
    return {"order": round(1e3 * point.time_from_start)}


def wanted(goal: Any) -> int:
    """The order of a goal, which must not be 7."""
    if goal.order == 7:
        raise ValueError("7 is no order")
    return int(goal.order)
