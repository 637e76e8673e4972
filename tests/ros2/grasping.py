"""Functions of `through` for the gripper of the simulated arm: an action that counts its steps."""

from __future__ import annotations

from typing import Any


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
