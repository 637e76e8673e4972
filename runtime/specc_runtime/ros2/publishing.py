"""What others in ROS can watch of a run: outputs and states, and every change of a state."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from typing import Any

from specc_runtime.records import StepRecord
from specc_runtime.ros2.binding import CHANGES, Ros2Published, Ros2Topic
from specc_runtime.ros2.messages import message_of

Tell = Callable[[str, dict[str, Any]], None]


class Publishing:
    """An observer of steps that tells messages of what is published, by the names of topics."""

    def __init__(self, published: Iterable[Ros2Published], tell: Tell) -> None:
        self._outputs: dict[tuple[str, str], Ros2Topic] = {}
        self._states: dict[str, Ros2Topic] = {}
        self._last: dict[str, str] = {}
        self._tell = tell
        for each in published:
            if each.output:
                self._outputs[each.subsystem, each.output] = each.topic
            else:
                self._states[each.subsystem] = each.topic

    def observe(self, record: StepRecord) -> None:
        """See `specc_runtime.records.Observer`. What is None is not sent."""
        name = record.subsystem
        for output, value in record.sent:
            topic = self._outputs.get((name, output))
            if topic is not None and value is not None:
                self._tell(topic.name, message_of(topic, value))
        if name in self._states and self._last.get(name) != record.state:
            self._changed(name, record)

    def _changed(self, name: str, record: StepRecord) -> None:
        before, self._last[name] = self._last.get(name), record.state
        topic = self._states[name]
        self._tell(topic.name, message_of(topic, record.state))
        change = {
            "subsystem": name,
            "from": before,
            "to": record.state,
            "time_s": round(record.time_s, 9),
        }
        self._tell(CHANGES.name, message_of(CHANGES, json.dumps(change)))
