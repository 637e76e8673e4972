"""What the device host loads: the node, or the reason why there is none."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from specc_runtime.hosting.devices import DeviceError

if TYPE_CHECKING:
    from specc_runtime.ros2.host.node import Devices


def devices() -> Devices:
    """The devices behind a node; raises DeviceError in a Python without ROS."""
    try:
        from specc_runtime.ros2.host.node import Devices
    except ImportError as error:
        raise DeviceError(
            f"{sys.executable} has no rclpy ({error}): source the setup file of your ROS before "
            "`specc run`, or name under `ros2:` the `python` that has it"
        ) from error
    return Devices()
