"""Transforms of tf2 as devices: where one frame is in another, whenever that is newer."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.time import Time

from specc_runtime.hosting.devices import DeviceError
from specc_runtime.ros2.host.plain import plain
from specc_runtime.ros2.host.stamps import measured_at

Put = Callable[[str, Any, float], None]


class Transforms:
    """Looks for the newest transform of each element, from `between[0]` to `between[1]`."""

    def __init__(self, node: Node, wanted: list[dict[str, Any]], put: Put) -> None:
        """`put` gets an element, its transform and when it was measured.

        Raises DeviceError where this ROS has no tf2.
        """
        try:
            from tf2_ros import Buffer, TransformListener
        except ImportError as error:
            raise DeviceError(f"this ROS has no tf2_ros ({error}): install it there") from error
        self._node = node
        self._buffer = Buffer()
        self._listener = TransformListener(self._buffer, node)
        self._wanted = wanted
        self._put = put
        self._last: dict[str, tuple[int, int]] = {}

    def look(self) -> None:
        """Tell what is new; one that never changes is told once."""
        for each in self._wanted:
            parent, child = each["between"]
            if not self._buffer.can_transform(parent, child, Time()):
                continue
            found = self._buffer.lookup_transform(parent, child, Time())
            stamp = found.header.stamp
            if self._last.get(each["name"]) != (stamp.sec, stamp.nanosec):
                self._last[each["name"]] = stamp.sec, stamp.nanosec
                self._tell(each, found)

    def _tell(self, each: dict[str, Any], found: Any) -> None:
        now_s, ros_s = time.monotonic(), self._node.get_clock().now().nanoseconds * 1e-9
        value: Any = plain(found.transform)
        try:
            now_s = measured_at(found.header.stamp, ros_s, now_s, "/tf")
        except DeviceError as error:  # of this element, and of no other
            value = error
        self._put(each["name"], value, now_s)
