"""What a run asks of an action or a service, and which of what is reported belongs to the last."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from specc_runtime.examination import same
from specc_runtime.plant import LOST, NO_SAMPLE, Sample
from specc_runtime.ros2.binding import Ros2Topic

_NONE = "none"
_ENDS = ("succeeded", "canceled", "aborted", "rejected", "answered", "missing", "late", LOST)
_OF_SERVICES = {"request": "goal", "response": "result"}
"""Parts of a service, and those of an action that they are like."""


class Goals:
    """The goals of one action, or the requests to one service, numbered from 1 on. The node reports
    values with these numbers.

    The first value after None, or a value that differs from the last one, is a new goal. From then
    on nothing is given of earlier goals: the next sample of the status is "none", and those of
    feedback and result are None, whatever the server has answered meanwhile.
    """

    def __init__(self, topics: Iterable[Ros2Topic]) -> None:
        """`topics` are the parts that are reported."""
        self._parts = {topic.name: _OF_SERVICES.get(topic.part, topic.part) for topic in topics}
        self._goal: Any = None
        self._number = 0
        self._has_ended = False
        """Whether a sample has told the end of the goal."""
        self._next: dict[str, Any] = {}
        """By elements: values that are given before what the node reports."""
        self._give("goal", None)

    def take(self, goal: Any) -> int:
        """Pursue a goal, or none; returns the number of the last goal."""
        is_other = not same(goal, self._goal)
        if goal is None and is_other and self._has_ended:
            self._give("status", _NONE)
        elif goal is not None and is_other:
            self._number += 1
            self._has_ended = False
            self._give("status", _NONE)
            self._give("feedback", None)
            self._give("result", None)
        if is_other:
            self._give("goal", goal)
        self._goal = goal
        return self._number

    def sample(self, name: str, reported: Callable[[str], Any]) -> Any:
        """The sample of an element; `reported` gives that of the node, with the goal's number."""
        if name in self._next:
            return Sample(self._next.pop(name), 0.0)
        if self._parts[name] == "goal":
            return NO_SAMPLE
        sample = reported(name)
        if sample is NO_SAMPLE:
            return NO_SAMPLE
        number, value = sample.value
        if number != self._number:
            return NO_SAMPLE
        if self._parts[name] == "status":
            self._has_ended = value in _ENDS
        return Sample(value, sample.age_s)

    def _give(self, part: str, value: Any) -> None:
        self._next |= {name: value for name, each in self._parts.items() if each == part}


def goals_of(topics: Iterable[Ros2Topic]) -> Mapping[str, Goals]:
    """The goals of all actions and services that are called, by the names of their elements,
    commanded ones as well.
    """
    parts = [topic for topic in topics if topic.is_call]
    found = {
        call: Goals(t for t in parts if (t.interface, t.topic) == call and not t.commanded)
        for call in {(topic.interface, topic.topic) for topic in parts}
    }
    return {topic.name: found[topic.interface, topic.topic] for topic in parts}
