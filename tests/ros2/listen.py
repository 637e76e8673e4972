"""Another node of the graph: prints messages of topics as lines of JSON, until it is ended."""

from __future__ import annotations

import importlib
import json
import sys
from contextlib import suppress
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile


class Listener(Node):
    """Listens to `topic=package/Type` of the command line; those with `!` keep their last."""

    def __init__(self, wanted: list[str]) -> None:
        super().__init__("listener")
        for text in wanted:
            topic, _, kind = text.partition("=")
            package, _, name = kind.rstrip("!").partition("/")
            cls = getattr(importlib.import_module(f"{package}.msg"), name)
            kept = DurabilityPolicy.TRANSIENT_LOCAL if kind.endswith("!") else None
            qos = QoSProfile(depth=10, durability=kept or DurabilityPolicy.VOLATILE)
            self.create_subscription(cls, topic, lambda m, t=topic: self._print(t, m), qos)

    def _print(self, topic: str, message: Any) -> None:
        frame = getattr(getattr(message, "header", None), "frame_id", "")
        data = message.data if hasattr(message, "data") else frame
        print(json.dumps([topic, data if isinstance(data, str) else list(data)]), flush=True)


def main() -> None:
    """Run until somebody ends the process."""
    rclpy.init()
    node = Listener(sys.argv[1:])
    print("ready", flush=True)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(node)


if __name__ == "__main__":
    main()
