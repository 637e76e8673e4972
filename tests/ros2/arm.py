"""An arm behind topics, in a process of its own: run by the Python of a ROS, without specc.

It moves its joints towards the positions that it is commanded, at most 1 rad/s, and measures the
wrench at its tool.
"""

from __future__ import annotations

import argparse
import faulthandler
import time
from contextlib import suppress

import rclpy
from geometry_msgs.msg import TransformStamped, WrenchStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from test_msgs.action import Fibonacci


class Arm(Node):
    """Joint states and wrenches out, positions in; `silent_after` messages behind the first
    command it says nothing.

    Its clock is `behind_s` behind.
    """

    def __init__(self, options: argparse.Namespace) -> None:
        super().__init__("arm")
        self._frame, self._left = options.frame, options.silent_after
        self._joints = options.joints.split(",")
        self._is_commanded = False
        self._behind = Duration(seconds=options.behind)
        self._step = 1.0 / options.rate
        self._at = dict.fromkeys(self._joints, 0.0)
        self._goal = dict(self._at)
        self._states = self.create_publisher(JointState, "/joint_states", 10)
        self._poses = self.create_publisher(TransformStamped, "/tf_of_tests", 10)
        self._wrenches = self.create_publisher(WrenchStamped, "/ft_sensor/wrench", 10)
        self.create_subscription(Float64MultiArray, options.commands, self._commanded, 10)
        self.create_timer(self._step, self._tick)
        self.clock_s, self._ticks = 100.0, 0
        self._clocks = self.create_publisher(Clock, "/clock", 10) if options.clock else None
        self._pause, self._jump, self._pace = options.pause, options.jump, options.pace
        self._grasping = ActionServer(
            self,
            Fibonacci,
            "/grasp",
            self._grasp,
            goal_callback=lambda _: self._thought(options.thinks),
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def _tell_time(self, clocks: Publisher) -> None:
        """At its pace; it stands still for a while once, or jumps back."""
        self._ticks += self._is_commanded
        if not 0 < self._ticks - self._pause < 100:
            self.clock_s += self._pace * self._step
        if self._ticks == self._jump:
            self.clock_s = 1.0
        now = Clock()
        now.clock.sec, now.clock.nanosec = divmod(round(self.clock_s * 1e9), 10**9)
        clocks.publish(now)

    def _thought(self, for_s: float) -> GoalResponse:
        """Accept a goal, but not at once."""
        print("asked", flush=True)
        time.sleep(for_s)
        return GoalResponse.ACCEPT

    def _grasp(self, handle: ServerGoalHandle) -> Fibonacci.Result:
        """Close in as many steps as the goal says, 50 ms each."""
        print("began", handle.request.order, flush=True)
        told, result = Fibonacci.Feedback(), Fibonacci.Result()
        for step in range(handle.request.order):
            told.sequence.append(step + 1)
            handle.publish_feedback(told)
            time.sleep(0.05)
            if handle.is_cancel_requested:
                handle.canceled()
                print("canceled", flush=True)
                result.sequence = [-step]
                return result
        handle.succeed()
        print("grasped", flush=True)
        result.sequence = told.sequence
        return result

    def _commanded(self, message: Float64MultiArray) -> None:
        if not self._is_commanded:
            print("commanded", flush=True)
        self._is_commanded = True
        self._goal = dict(zip(sorted(self._joints), message.data, strict=True))

    def _tick(self) -> None:
        for name, goal in self._goal.items():
            away = goal - self._at[name]
            self._at[name] += max(-self._step, min(self._step, away))
        if self._clocks is not None:
            self._tell_time(self._clocks)
        if self._left == 0:
            return
        self._left -= self._is_commanded
        now = (self.get_clock().now() - self._behind).to_msg()
        if self._clocks is not None:
            now.sec, now.nanosec = divmod(round(self.clock_s * 1e9), 10**9)
        states = JointState(name=self._joints, position=[*self._at.values()])
        states.header.stamp = now
        self._states.publish(states)
        pose = TransformStamped(child_frame_id="tool0")
        pose.header.stamp, pose.header.frame_id = now, "base_link"
        pose.transform.translation.z = max(self._at.values())
        self._poses.publish(pose)
        wrench = WrenchStamped()
        wrench.header.stamp, wrench.header.frame_id = now, self._frame
        wrench.wrench.force.z = -1.0 - max(self._at.values())
        self._wrenches.publish(wrench)


def main() -> None:
    """Run until somebody ends the process."""
    faulthandler.enable()  # shows where a process is that does not end, see `end` in conftest.py
    parser = argparse.ArgumentParser()
    parser.add_argument("--rate", type=float, default=100.0)
    # In another order than readers have them.
    parser.add_argument("--joints", default="q3,q1,q2")
    parser.add_argument("--commands", default="/position_controller/commands")
    parser.add_argument("--frame", default="ft_frame")
    parser.add_argument("--silent-after", type=int, default=-1)
    parser.add_argument("--clock", action="store_true")
    parser.add_argument("--pace", type=float, default=2.0)
    parser.add_argument("--pause", type=int, default=10**6)
    parser.add_argument("--jump", type=int, default=10**6)
    parser.add_argument("--behind", type=float, default=0.0)
    parser.add_argument("--thinks", type=float, default=0.0)
    options, of_ros = parser.parse_known_args()
    rclpy.init(args=of_ros)
    arm = Arm(options)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor = MultiThreadedExecutor(num_threads=4)
        executor.add_node(arm)
        # Whoever reads this may end the process at once, which only an executor that spins sees.
        executor.create_task(print, "ready", flush=True)
        executor.spin()
    if options.clock:
        print(arm.clock_s, flush=True)


if __name__ == "__main__":
    main()
