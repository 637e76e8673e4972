"""Quality of service: profiles from plain data, and why two ends do not match."""

from __future__ import annotations

from typing import Any

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)


def profile(options: dict[str, Any], *, commanded: bool, depth: int = 1) -> QoSProfile:
    """The profile of a topic: the latest message counts, or as many as its `depth` says.

    Where nothing is said, what is read takes what any publisher offers, and what is sent goes to
    any subscription. ROS gives the last message of a latched topic to reliable readers only, so
    a latched one is reliable.
    """
    latched = options.get("durability", "volatile") == "transient_local"
    usual = "reliable" if commanded or latched else "best_effort"
    reliable = options.get("reliability") or usual
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=int(options.get("depth", depth)),
        reliability=ReliabilityPolicy.RELIABLE
        if reliable == "reliable"
        else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def is_latched(offered: QoSProfile) -> bool:
    """Whether a publisher gives its last message to those who come late."""
    wanted = DurabilityPolicy.TRANSIENT_LOCAL, ReliabilityPolicy.RELIABLE
    return (offered.durability, offered.reliability) == wanted


def mismatch(publisher: QoSProfile, subscription: QoSProfile) -> str:
    """Why a subscription gets nothing of a publisher; empty if it does."""
    compatibility, reason = qos_check_compatible(publisher, subscription)
    return "" if compatibility != QoSCompatibility.ERROR else reason.strip(" ;")
