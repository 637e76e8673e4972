"""An arm behind topics, in a process of its own: run by the Python of a ROS, without specc.

It moves its joints towards the positions that it is commanded, at most 1 rad/s, and measures the
wrench at its tool.
"""

from __future__ import annotations

import argparse
from contextlib import suppress

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

JOINTS = ("q3", "q1", "q2")
"""In another order than readers have them."""


class Arm(Node):
    """Joint states and wrenches out, positions in; `silent_after` messages behind the first
    command it says nothing.

    Its clock is `behind_s` behind.
    """

    def __init__(self, rate_hz: float, frame: str, silent_after: int, behind_s: float) -> None:
        super().__init__("arm")
        self._frame, self._left = frame, silent_after
        self._is_commanded = False
        self._behind = Duration(seconds=behind_s)
        self._step = 1.0 / rate_hz
        self._at = dict.fromkeys(JOINTS, 0.0)
        self._goal = dict(self._at)
        self._states = self.create_publisher(JointState, "/joint_states", 10)
        self._wrenches = self.create_publisher(WrenchStamped, "/ft_sensor/wrench", 10)
        commands = "/position_controller/commands"
        self.create_subscription(Float64MultiArray, commands, self._commanded, 10)
        self.create_timer(self._step, self._tick)

    def _commanded(self, message: Float64MultiArray) -> None:
        self._is_commanded = True
        self._goal = dict(zip(sorted(JOINTS), message.data, strict=True))

    def _tick(self) -> None:
        for name, goal in self._goal.items():
            away = goal - self._at[name]
            self._at[name] += max(-self._step, min(self._step, away))
        if self._left == 0:
            return
        self._left -= self._is_commanded
        now = (self.get_clock().now() - self._behind).to_msg()
        states = JointState(name=list(JOINTS), position=[self._at[name] for name in JOINTS])
        states.header.stamp = now
        self._states.publish(states)
        wrench = WrenchStamped()
        wrench.header.stamp, wrench.header.frame_id = now, self._frame
        wrench.wrench.force.z = -1.0 - self._at["q1"]
        self._wrenches.publish(wrench)


def main() -> None:
    """Run until somebody ends the process."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rate", type=float, default=100.0)
    parser.add_argument("--frame", default="ft_frame")
    parser.add_argument("--silent-after", type=int, default=-1)
    parser.add_argument("--behind", type=float, default=0.0)
    options = parser.parse_args()
    rclpy.init()
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(Arm(options.rate, options.frame, options.silent_after, options.behind))


if __name__ == "__main__":
    main()
