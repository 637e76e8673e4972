"""The ends of bench/ros_latency.py and the relay between them, each a process of a ROS of its own.

    PYTHON bench/harness/ros_ends.py {sender,relay,receiver}

Messages have the time of sending, s of the monotonic clock, as their first number. The sender reads
lines `TOPIC MESSAGES PERIOD_S` and prints `done` behind each. The receiver prints the time of
sending of each message on `/passed`, the first time that it comes, and its latency, s.
"""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64MultiArray

NUMBERS = 125
PRIORITY = 10
"""That of the device host, where it is permitted."""
READ = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
SENT = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
"""As a run has them, unless it says something else."""


def sender(node: Node) -> None:
    """Send what the lines ask for."""
    publishers = {t: node.create_publisher(Float64MultiArray, t, SENT) for t in ("/sent", "/bare")}
    message = Float64MultiArray(data=[0.0] * NUMBERS)
    print("ready", flush=True)
    for line in sys.stdin:
        topic, count, period_s = line.split()
        begin_s = time.monotonic()
        for number in range(int(count)):
            time.sleep(max(0.0, begin_s + number * float(period_s) - time.monotonic()))
            message.data[0] = time.monotonic()
            publishers[topic].publish(message)
        print("done", flush=True)


def relay(node: Node) -> None:
    """Pass on what comes."""
    publisher = node.create_publisher(Float64MultiArray, "/passed", SENT)
    node.create_subscription(Float64MultiArray, "/bare", publisher.publish, READ)
    print("ready", flush=True)
    rclpy.spin(node)


def receiver(node: Node) -> None:
    """Tell what comes."""
    last_s = 0.0

    def receive(message: Any) -> None:
        nonlocal last_s
        sent_s = message.data[0]
        if sent_s > last_s:
            last_s = sent_s
            print(f"{sent_s:.9f} {time.monotonic() - sent_s:.9f}", flush=True)

    node.create_subscription(Float64MultiArray, "/passed", receive, READ)
    print("ready", flush=True)
    rclpy.spin(node)


if __name__ == "__main__":
    with suppress(AttributeError, OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    rclpy.init()
    with suppress(ExternalShutdownException, KeyboardInterrupt):
        {"sender": sender, "relay": relay, "receiver": receiver}[sys.argv[1]](
            Node(sys.argv[1], start_parameter_services=False, enable_rosout=False)
        )
