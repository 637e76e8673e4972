"""The tree of transforms in a bag, and where one frame is in another, as tf2 says it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from math import inf
from typing import Any

import numpy as np

from specc_runtime.ros2.binding import Ros2Topic
from specc_runtime.ros2.messages import message_of, value_of

TOPICS = ("/tf", "/tf_static")
_DEEPEST = 1000
_LINK = Ros2Topic("", "/tf", "geometry_msgs/Transform", "transform")


@dataclass(slots=True)
class _Link:
    parent: str
    pose: Any
    stamp_s: float
    """inf if it never changes."""


@dataclass(slots=True)
class TransformTree:
    """The newest transform of each frame to its parent."""

    _links: dict[str, _Link] = field(default_factory=dict)

    def take(self, message: Mapping[str, Any], *, is_static: bool) -> None:
        """Take a `tf2_msgs/TFMessage`; raises PlantError for a turn that is none."""
        for each in message["transforms"]:
            stamp, parent = each["header"]["stamp"], each["header"]["frame_id"]
            stamp_s = inf if is_static else stamp["sec"] + stamp["nanosec"] / 1e9
            child = each["child_frame_id"]
            pose = value_of(_LINK, each["transform"])
            self._links[_bare(child)] = _Link(_bare(parent), pose, stamp_s)

    def between(self, parent: str, child: str) -> tuple[dict[str, Any], float] | None:
        """The fields of the transform, and the stamp of the oldest that it is made of, in s.

        None where the tree does not have it; the stamp is inf if nothing in it ever changes.
        """
        up, down = self._way(_bare(parent)), self._way(_bare(child))
        above = (_bare(parent), *(link.parent for link in up))
        below = (_bare(child), *(link.parent for link in down))
        both = zip(reversed(above), reversed(below), strict=False)
        shared = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], both))
        if not shared:
            return None
        up, down = up[: len(above) - shared], down[: len(below) - shared]
        pose = np.linalg.inv(_product(up)) @ _product(down)
        return message_of(_LINK, pose), min((link.stamp_s for link in (*up, *down)), default=inf)

    def _way(self, frame: str) -> list[_Link]:
        """The links from a frame to its root."""
        links: list[_Link] = []
        while (link := self._links.get(frame)) is not None and len(links) < _DEEPEST:
            links.append(link)
            frame = link.parent
        return links


def _bare(frame: str) -> str:
    return frame.removeprefix("/")


def _product(links: list[_Link]) -> Any:
    pose = np.eye(4)
    for link in links:
        pose = link.pose @ pose
    return pose
