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


def profile(options: dict[str, Any], *, commanded: bool) -> QoSProfile:
    """The profile of a topic: the latest message counts.

    Where nothing is said, what is read takes what any publisher offers, and what is sent goes to
    any subscription.
    """
    reliable = options.get("reliability", "reliable" if commanded else "best_effort")
    latched = options.get("durability", "volatile") == "transient_local"
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=int(options.get("depth", 1)),
        reliability=ReliabilityPolicy.RELIABLE
        if reliable == "reliable"
        else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def mismatch(publisher: QoSProfile, subscription: QoSProfile) -> str:
    """Why a subscription gets nothing of a publisher; empty if it does."""
    compatibility, reason = qos_check_compatible(publisher, subscription)
    return "" if compatibility != QoSCompatibility.ERROR else reason.strip(" ;")
