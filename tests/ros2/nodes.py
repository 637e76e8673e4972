"""Other nodes of the graph, each in a process of its own: run by a Python of ROS, without specc.

The first argument names the node, the others are its own.
"""

from __future__ import annotations

import sys
from contextlib import suppress

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Bool


def latched(topic: str) -> list[Node]:
    """Sends one message and keeps it for those who come late."""
    node = rclpy.create_node("safety")
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(Bool, topic, qos).publish(Bool(data=True))
    return [node]


NODES = {"latched": latched}


def main() -> None:
    """Run until somebody ends the process."""
    rclpy.init()
    name, *given = sys.argv[1:]
    executor = SingleThreadedExecutor()
    for node in NODES[name](*given):
        executor.add_node(node)
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == "__main__":
    main()
