"""Looks at the graph of ROS, by a device host in the Python of ROS that ends at once."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from typing import Any

from specc_runtime.hosting.starting import Host
from specc_runtime.hosting.wire import plain
from specc_runtime.options import UsageError
from specc_runtime.plants.errors import PlantError
from specc_runtime.ros2.plant import START_S

_GRAPH = "specc_runtime.ros2.host.opening:graph"
ERRORS = (UsageError, PlantError)


def graph_of(python: str, wait_s: float, types: Iterable[str], most: int) -> dict[str, Any]:
    """What there is on the graph, after `wait_s` of looking: plain data, `host.graph` says which.

    `types`, as `package/msg/Type`, are those of the topics that are listened to; of topics and of
    actions it has at most that many. Raises UsageError for a Python that cannot be started;
    PlantError for one without ROS.
    """
    until_s = time.monotonic() + wait_s + START_S
    node = {"node": f"specc_init_{os.getpid()}", "namespace": "", "use_sim_time": False}
    host = Host(python, 1)
    try:
        host.open(
            {
                "devices": _GRAPH,
                "path": [],
                "config": {**node, "wait_s": wait_s, "types": list(types), "most": most},
                "elements": ["graph"],
                "silence": {},
            },
            until_s,
        )
        while (raw := host.memory.read(0)) is None:
            if not host.wait(min(until_s, time.monotonic() + 0.01)) and time.monotonic() < until_s:
                continue
            raise PlantError(f"the graph cannot be read{host.tail()}")
        found: dict[str, Any] = plain(raw.data)
        return found
    finally:
        host.close()
