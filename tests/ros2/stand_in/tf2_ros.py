"""Stands in for tf2_ros, of which no wheels are there: one transform, from TransformStamped."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node


class Buffer:
    """The newest transform of each pair of frames, without any between others."""

    def __init__(self) -> None:
        self.known: dict[tuple[str, str], TransformStamped] = {}

    def can_transform(self, target: str, source: str, time: Any) -> bool:
        return (target, source) in self.known

    def lookup_transform(self, target: str, source: str, time: Any) -> TransformStamped:
        return self.known[target, source]


class TransformListener:
    """Puts what comes on a topic into the buffer."""

    def __init__(self, buffer: Buffer, node: Node) -> None:
        def receive(message: TransformStamped) -> None:
            buffer.known[message.header.frame_id, message.child_frame_id] = message

        node.create_subscription(TransformStamped, "/tf_of_tests", receive, 10)
