"""A run as a bag: what the node has told the run and got from it, states, and why they changed.

Messages are made of what crosses between node and agent anyway. The thread that writes the file
turns them into bytes, so the run only notes them.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from functools import partial
from typing import Any

import numpy as np

from specc_runtime.changes import Event
from specc_runtime.clock import WallClock
from specc_runtime.companion import View
from specc_runtime.hosting.wire import packed, plain
from specc_runtime.loading import load_layouts
from specc_runtime.options import Options
from specc_runtime.printing import say
from specc_runtime.recording.log import Channel, Log
from specc_runtime.recording.steps import passage_of
from specc_runtime.records import StepRecord
from specc_runtime.report import Report
from specc_runtime.ros2.bags.names import TopicNames
from specc_runtime.ros2.bags.types import TEXT, NoMessage, Types, text_of, whole_type
from specc_runtime.ros2.binding import CHANGES, Ros2Topic
from specc_runtime.ros2.messages import message_of
from specc_runtime.snapshot import Values
from specc_runtime.system import System

PROFILE = "ros2"
_NOTHING = packed(None)
Fields = Callable[[Any], Mapping[str, Any]]


class BagRecorder:
    """Writes a run as a bag: an observer of its records, a companion, and a listener of the plant
    behind ROS 2.

    Times are those of the run, from its begin on: what a step has read has the time of the step.
    """

    is_whole = False
    period_s = 1.0

    def __init__(self, options: Options, system: System, plant: Any, clock: WallClock) -> None:
        """Raises UsageError if the file cannot be written."""
        assert options.record is not None
        self.report: Callable[[], Report] | None = None
        self._types = Types()
        ros2 = system.plant.ros2 if system.plant else None
        self._names = TopicNames(ros2.node if ros2 else system.name, options.ros_args)
        self._log = Log(options.record, clock, PROFILE)
        self._channels: dict[str, Channel] = {}
        """By elements, subsystems, and outputs of subsystems as `subsystem.y.output`."""
        self._waiting: list[tuple[Channel, float, Any]] | None = []
        """What is to be written once it is known when the run began."""
        self._last: dict[str, str] = {}
        self._types_sent: dict[str, str] = {}
        self._newest: dict[str, tuple[float, bytes]] = {}
        """By topics: the last message."""
        self._subsystems = {s.subsystem.name: s.subsystem for s in system.subsystems}
        self._layouts = load_layouts(system)
        self._topics = {topic.name: topic for topic in ros2.topics} if ros2 else {}
        self._published = {
            (each.subsystem, each.output): each.topic
            for each in (ros2.published if ros2 else ())
            if each.output
        }
        self._sends_all = ros2 is None
        defined = plant.definitions() if ros2 is not None else {}
        for topic in self._topics.values():
            self._open(topic, defined)
        for (name, output), topic in self._published.items():
            where = self._names.full(topic.topic)
            self._channels[f"{name}.y.{output}"] = self._channel(
                where, whole_type(topic.type), _itself
            )
        for name in self._subsystems:
            self._channels[name] = self._channel(
                self._names.of_element(name), TEXT, lambda state: {"data": state}
            )
        changes = self._names.full(CHANGES.topic)
        self._channels[CHANGES.name] = self._channel(changes, TEXT, lambda text: {"data": text})
        self._ros_ns: Callable[[], int] = clock.date_ns
        if ros2 is not None:
            self._ros_ns = plant.ros_ns
            plant.listener = self

    # The channels.

    def _channel(self, where: str, type_: str, fields: Fields) -> Channel:
        definition = self._types.definition(type_)
        self._types.encoded(type_, {})  # what packs messages is made now, and not in the run
        texts = partial(self._texts, type_, fields)
        options: dict[str, Any] = {"encoding": "cdr", "is_deferred": True}
        return self._log.channel(where, type_, definition, texts, **options)

    def _open(self, topic: Ros2Topic, defined: Mapping[str, str]) -> None:
        """The channel of an element: that of its topic, or one for texts."""
        type_, why = whole_type(topic.type), ""
        if type_ not in self._types and topic.type in defined:
            try:
                self._types.learn(type_, defined[topic.type])
            except NoMessage as error:
                why = str(error)
        if topic.between:
            where, type_ = self._names.of_element(topic.name), "geometry_msgs/msg/TransformStamped"
        else:
            where = self._names.full(topic.topic)
        fields: Fields = partial(_transform, topic) if topic.between else _itself
        if topic.interface or type_ not in self._types:
            where, type_, fields = self._names.of_element(topic.name), TEXT, _as_text
            if not topic.interface:
                why = why or f"{topic.type} is not known"
                say(f"--profile ros2: {topic.name} is written as JSON, as {where}: {why}")
        self._channels[topic.name] = self._channel(where, type_, fields)

    def _texts(
        self, type_: str, fields: Fields, contents: Sequence[Any], times: Sequence[float], _: Any
    ) -> Iterator[bytes]:
        """The bytes of messages; a content is what the message is made of, and how old that is."""
        is_stamped = self._types.is_stamped(type_)
        for (content, age_s), time_s in zip(contents, times, strict=True):
            made = fields(plain(content) if type(content) is bytes else content)
            if is_stamped:
                made = _stamped(made, round((time_s - age_s) * 1e9) + self._log.begin_ns)
            yield self._types.encoded(type_, made)

    def _add(self, name: str, time_s: float, content: Any, age_s: float = 0.0) -> None:
        channel = self._channels[name]
        if self._waiting is not None:
            self._waiting.append((channel, time_s, (content, age_s)))
        else:
            channel.add(time_s, (content, age_s))

    def _begin(self, begin_ns: int) -> None:
        """Write from now on: it is known when the run began."""
        self._log.begin_ns = begin_ns
        waiting, self._waiting = self._waiting, None
        for channel, time_s, content in waiting or ():
            channel.add(time_s, content)

    # What the plant tells.

    def heard(self, name: str, data: bytes, age_s: float, time_s: float) -> None:
        """The node has told the data of an element, that old, at a time of the run."""
        topic = self._topics[name]
        if data == _NOTHING and not topic.interface:
            return  # it is lost
        if topic.interface or self._newest.get(topic.topic) != (time_s, data):
            self._add(name, time_s, data, age_s)  # else it is another element of the same message
        self._newest[topic.topic] = time_s, data

    def sent(self, name: str, data: Any, time_s: float) -> None:
        """The node gets the data of an element."""
        self._add(name, time_s, data)

    # What the run tells.

    def __call__(self, record: StepRecord) -> None:
        """See `specc_runtime.records.Observer`."""
        if self._waiting is not None:
            self._begin(self._ros_ns() - round(record.visible_s * 1e9))
        name = record.subsystem
        for output, value in record.sent:
            topic = self._published.get((name, output))
            if topic is not None and value is not None:
                self._output(name, output, record.visible_s, topic, value)
            elif self._sends_all and value is not None:
                self._output(name, output, record.visible_s, _natural(value), value)
        if self._last.get(name) != record.state:
            self._changed(record)

    def _output(self, name: str, output: str, time_s: float, topic: Ros2Topic, value: Any) -> None:
        key = f"{name}.y.{output}"
        if self._types_sent.setdefault(key, topic.type) != topic.type:
            return  # a channel has messages of one type
        if key not in self._channels:
            path = next(e.name for e in self._layouts[name].y if e.attribute == output)
            where = self._names.of_element(".".join((name, "y", *path)))
            self._channels[key] = self._channel(where, whole_type(topic.type), _itself)
        is_json = topic.shape == "message"
        fields = {"data": text_of(_bare(value))} if is_json else message_of(topic, value)
        self._add(key, time_s, fields)

    def _changed(self, record: StepRecord) -> None:
        name, row = record.subsystem, record.transition
        before = self._last.get(name)
        self._last[name] = record.state
        self._add(name, record.time_s, record.state)
        table, ends = self._subsystems[name].transitions, self._layouts[name].ends
        change: dict[str, Any] = {
            "subsystem": name,
            "from": before,
            "to": record.state,
            "time_s": round(record.time_s, 9),
        }
        if before is not None and row >= 0:
            passage = passage_of(table, ends, before, row, record.state)
            change |= {key: passage[key] for key in ("cause", "transition", "conditions")}
        self._add(CHANGES.name, record.time_s, json.dumps(change, ensure_ascii=False))

    def keep(self, time_s: float, saved: Callable[[Values], dict[str, Any]]) -> None:
        """See `specc_runtime.companion.Recording`: nothing goes on from a bag."""

    def changed(self, change: Event, time_s: float) -> None:
        """A constant or an element of the panel is another one from now on."""
        data = change.as_data() | {"time_s": round(time_s, 9)}
        del data["tick"]
        self._add(CHANGES.name, time_s, json.dumps(data, ensure_ascii=False))

    def tick(self, view: View) -> None:
        """See `Companion`."""

    def close(self) -> None:
        """See `Companion`. Raises OutputLost if the bag is not complete."""
        if self._waiting is not None:
            self._begin(self._ros_ns())
        self._log.close()


def _itself(fields: Any) -> Mapping[str, Any]:
    assert isinstance(fields, Mapping)
    return fields


def _as_text(data: Any) -> Mapping[str, Any]:
    return {"data": text_of(data)}


def _transform(topic: Ros2Topic, fields: Any) -> Mapping[str, Any]:
    parent, child = topic.between
    return {"header": {"frame_id": parent}, "child_frame_id": child, "transform": fields}


def _stamped(fields: Mapping[str, Any], time_ns: int) -> Mapping[str, Any]:
    """The fields with the time of measurement in the header, if there is none."""
    header = fields.get("header", {})
    stamp = header.get("stamp", {})
    if stamp.get("sec") or stamp.get("nanosec"):
        return fields
    sec, nanosec = divmod(time_ns, 1_000_000_000)
    return {**fields, "header": {**header, "stamp": {"sec": sec, "nanosec": nanosec}}}


# Outputs that nothing gives a topic.


def _natural(value: Any) -> Ros2Topic:
    """The usual message of a value: numbers and arrays of them, texts; others are JSON."""
    kinds = {bool: "Bool", int: "Int64", float: "Float64", str: "String"}
    if type(value) in kinds:
        return Ros2Topic("", "", f"std_msgs/{kinds[type(value)]}", "scalar", "data")
    if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype == np.float64:
        return Ros2Topic("", "", "std_msgs/Float64MultiArray", "vector", "data")
    if isinstance(value, np.ndarray) and value.shape == (4, 4):
        return Ros2Topic("", "", "geometry_msgs/PoseStamped", "pose", "pose")
    if isinstance(value, np.ndarray) and value.ndim == 3 and value.dtype == np.uint8:
        return Ros2Topic("", "", "sensor_msgs/Image", "image")
    if isinstance(value, np.ndarray) and value.ndim == 2 and value.dtype == np.float32:
        return Ros2Topic("", "", "sensor_msgs/Image", "depth")
    return Ros2Topic("", "", "std_msgs/String", "message")


def _bare(value: Any) -> Any:
    """Plain data of any value that is sent."""
    if isinstance(value, Enum):
        return value.name
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_bare(item) for item in value]
    names = getattr(type(value), "__dataclass_fields__", ())
    if names:
        return {name: _bare(getattr(value, name)) for name in names}
    return value if isinstance(value, bool | int | float | str | None) else str(value)
