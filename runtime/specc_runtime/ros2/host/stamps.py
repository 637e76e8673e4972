"""When a message was measured, on the monotonic clock, from the stamp in its header."""

from __future__ import annotations

from typing import Any

from specc_runtime.hosting.devices import DeviceError

FUTURE_S = 1.0
"""How far a stamp may be ahead of its arrival: clocks of two machines differ."""
PAST_S = 60.0
"""How old a message may be when it arrives, unless it was kept for those who come late."""


def measured_at(
    stamp: Any,
    now_ros_s: float,
    now_s: float,
    topic: str,
    *,
    latched: bool = False,
    receiver: str = "this node",
) -> float:
    """The time of measurement, in s of `time.monotonic()`, never after the arrival `now_s`.

    `stamp` has `sec` and `nanosec` on the clock of ROS, which says `now_ros_s` at the arrival;
    without one, or where it is not set, a message is measured when it arrives. `latched` is for
    topics whose messages wait for readers, however long. Raises DeviceError for others that are
    more than `PAST_S` old or `FUTURE_S` ahead: that is a clock that is wrong, and no age.
    """
    if stamp is None or not (stamp.sec or stamp.nanosec):
        return now_s
    age_s = float(now_ros_s - (stamp.sec + stamp.nanosec * 1e-9))
    if age_s < -FUTURE_S or (age_s > PAST_S and not latched):
        how = f"{age_s:.9g} s before" if age_s > 0 else f"{-age_s:.9g} s after"
        raise DeviceError(
            f"a message on {topic} is stamped {how} it arrived: the clock of its sender is another "
            f"one than that of {receiver} (is one of them simulated, `use_sim_time`?)"
        )
    return now_s - max(age_s, 0.0)
