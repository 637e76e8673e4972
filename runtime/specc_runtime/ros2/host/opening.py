"""What the device host loads: the node or the graph, or the reason why there is none."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from specc_runtime.hosting.devices import DeviceError

if TYPE_CHECKING:
    from specc_runtime.ros2.host.graph import Graph
    from specc_runtime.ros2.host.node import NodeDevices


def devices() -> NodeDevices:
    """The devices behind a node; raises DeviceError in a Python without ROS."""
    try:
        from specc_runtime.ros2.host.node import NodeDevices
    except ImportError as error:
        raise _lacking(
            error, "`specc run`, or name under `ros2:` the `python` that has it"
        ) from error
    return NodeDevices()


def graph() -> Graph:
    """What looks at the graph; raises DeviceError in a Python without ROS."""
    try:
        from specc_runtime.ros2.host.graph import Graph
    except ImportError as error:
        way = "`specc init`, or name the Python that has it: --python /usr/bin/python3"
        raise _lacking(error, way) from error
    return Graph()


def _lacking(error: ImportError, way: str) -> DeviceError:
    return DeviceError(
        f"{sys.executable} has no rclpy ({error}): source the setup file of your ROS before {way}"
    )
