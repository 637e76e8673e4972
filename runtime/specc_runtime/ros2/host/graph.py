"""The graph of ROS as it is seen for a while: its topics, what their messages hold, its actions."""

from __future__ import annotations

import math
import time
from typing import Any

from rclpy.action import get_action_names_and_types
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy
from rclpy.serialization import deserialize_message

from specc_runtime.hosting.devices import DeviceError
from specc_runtime.ros2.host.node import NodeDevices
from specc_runtime.ros2.host.plain import interface
from specc_runtime.ros2.host.qos import is_latched, profile

GRAPH = "graph"
"""The name of the one element."""
_LOOK_S = 0.2
_WAITING = 10
"""Messages of a topic that wait: several publishers send at the same time."""
_LONGEST = 200
"""Of a text of somebody else, in characters, and of a list of them."""
_JOINT_STATE = "sensor_msgs/msg/JointState"
_MOST_PARTS = 20
"""Lists of joints that messages of one topic have."""
_LATCHED = DurabilityPolicy.TRANSIENT_LOCAL


class _Heard:
    """What came of one topic: the last message as bytes, how many there were, and when.

    Of joint states also the same for each list of joints that came: `parts`.
    """

    def __init__(self) -> None:
        self.last = b""
        self.times_s: list[float] = []
        self.date_s = 0.0
        """When the last message came, s since 1970."""
        self.parts: dict[tuple[str, ...], _Heard] = {}

    def take(self, data: bytes) -> None:
        self.last = data
        self.times_s.append(time.monotonic())
        self.date_s = time.time()

    def take_joints(self, data: bytes) -> None:
        self.take(data)
        try:
            names = tuple(deserialize_message(data, interface(_JOINT_STATE)).name)
        except Exception:  # noqa: BLE001  # the bytes are a stranger's
            return
        if names in self.parts or len(self.parts) < _MOST_PARTS:
            self.parts.setdefault(names, _Heard()).take(data)

    @property
    def times(self) -> dict[str, Any]:
        """How many there were, and the mean and the longest time between them."""
        gaps_s = [b - a for a, b in zip(self.times_s, self.times_s[1:], strict=False)]
        mean_s = sum(gaps_s) / max(1, len(gaps_s))
        return {"count": len(self.times_s), "mean_s": mean_s, "longest_s": max(gaps_s, default=0.0)}


class Graph(NodeDevices):
    """A device with one element, the graph.

    Its configuration has how long it looks, `wait_s`; how many topics it tells of at most, `most`;
    and the `types` of those that it listens to.
    """

    def open(self, config: dict[str, Any]) -> None:
        """Look; returns after `wait_s`."""
        node = self._begin(config)
        assert self._executor is not None, "it has begun"
        heard: dict[str, _Heard] = {}
        end_s, look_s = time.monotonic() + config["wait_s"], 0.0
        while (now_s := time.monotonic()) < end_s:
            if now_s >= look_s:
                look_s = now_s + _LOOK_S
                for name, types in _topics(node)[: config["most"]]:
                    if name not in heard and len(types) == 1 and types[0] in config["types"]:
                        _listen(node, name, types[0], heard)
            self._executor.spin_once(timeout_sec=min(end_s, look_s) - now_s)
        topics = _topics(node)
        data = [_topic(node, *each, heard) for each in topics[: config["most"]]]
        more = len(topics) - len(data)
        self._put(GRAPH, {"topics": data, "more": more, "actions": _actions(node, config["most"])})


def _topics(node: Node) -> list[tuple[str, list[str]]]:
    """Names and types of topics, without those that are hidden, parts of actions among them."""
    found = sorted(node.get_topic_names_and_types())
    return [(name, types) for name, types in found if types and "/_" not in name]


def _listen(node: Node, name: str, type_name: str, heard: dict[str, _Heard]) -> None:
    ends = node.get_publishers_info_by_topic(name)
    if not ends:
        return
    try:
        cls = interface(type_name)
    except DeviceError:
        return
    heard[name] = _Heard()
    latched = all(is_latched(end.qos_profile) for end in ends)
    qos = profile(
        {"durability": "transient_local"} if latched else {}, commanded=False, depth=_WAITING
    )
    take = heard[name].take_joints if type_name == _JOINT_STATE else heard[name].take
    # As bytes, since images would take all the time there is.
    node.create_subscription(cls, name, take, qos, raw=True)


def _topic(node: Node, name: str, types: list[str], heard: dict[str, _Heard]) -> dict[str, Any]:
    own = node.get_name()
    publishers = [e for e in node.get_publishers_info_by_topic(name) if e.node_name != own]
    readers = [e for e in node.get_subscriptions_info_by_topic(name) if e.node_name != own]
    data = {
        "name": name[: _LONGEST + 1],
        "types": [each[:_LONGEST] for each in types],
        "publishers": _nodes(publishers),
        "readers": _nodes(readers),
        "published_kept": bool(publishers) and all(is_latched(e.qos_profile) for e in publishers),
        "read_kept": any(e.qos_profile.durability == _LATCHED for e in readers),
    }
    came = heard.get(name)
    if came is not None and came.last:
        data |= _came(came, types[0])
        data["parts"] = [_came(part, types[0]) for part in came.parts.values()]
    return data


def _came(heard: _Heard, type_name: str) -> dict[str, Any]:
    return {"message": _summary(heard.last, type_name, heard.date_s), **heard.times}


def _nodes(ends: list[Any]) -> list[str]:
    names = {f"{e.node_namespace.rstrip('/')}/{e.node_name}"[:_LONGEST] for e in ends}
    return sorted(names)[:_LONGEST]


def _summary(data: bytes, type_name: str, date_s: float) -> dict[str, Any]:
    """Of a message that came then: how large its values are, how old, and in which frames."""
    try:
        message: Any = deserialize_message(data, interface(type_name))
    except Exception:  # noqa: BLE001  # the bytes are a stranger's
        return {}
    summary: dict[str, Any] = {}
    header = getattr(message, "header", None)
    if header is not None:
        summary["header.frame_id"] = header.frame_id[:_LONGEST]
        if header.stamp.sec or header.stamp.nanosec:
            summary["age_s"] = date_s - (header.stamp.sec + header.stamp.nanosec * 1e-9)
    for name in ("child_frame_id", "encoding"):
        if hasattr(message, name):
            summary[name] = getattr(message, name)[:_LONGEST]
    for name in ("height", "width"):
        if hasattr(message, name):
            summary[name] = getattr(message, name)
    if hasattr(getattr(message, "data", None), "__len__"):
        summary["size"] = len(message.data)
    if isinstance(joints := getattr(message, "name", None), list):
        summary["joints"] = [joint[:_LONGEST] for joint in joints[:_LONGEST]]
        for field in ("position", "velocity", "effort"):
            numbers = getattr(message, field, ())
            summary[field] = len(numbers) == len(joints) and all(map(math.isfinite, numbers))
    return summary


def _actions(node: Node, most: int) -> list[tuple[str, list[str]]]:
    """Names and types of actions that somebody serves."""
    found = sorted(get_action_names_and_types(node))
    served = [each for each in found if node.count_publishers(f"{each[0]}/_action/status")]
    return [(name[: _LONGEST + 1], types) for name, types in served[:most]]
