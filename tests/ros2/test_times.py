"""When messages were measured, what the clock of a simulation does, and what is published when."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import pytest
from specc_runtime.hosting.devices import DeviceError
from specc_runtime.plants.errors import PlantError
from specc_runtime.records import StepRecord
from specc_runtime.ros2.binding import Ros2Published, Ros2Topic
from specc_runtime.ros2.clock import RosClock
from specc_runtime.ros2.host.stamps import FUTURE_S, PAST_S, measured_at
from specc_runtime.ros2.publishing import Publishing


@dataclass
class Stamp:
    sec: int
    nanosec: int = 0


NOW_ROS_S, NOW_S = 1_800_000_000.0, 50.0


def test_a_stamp_is_an_age_on_the_clock_of_the_run() -> None:
    stamp = Stamp(1_799_999_999, 750_000_000)
    assert measured_at(stamp, NOW_ROS_S, NOW_S, "/q") == 49.75
    assert measured_at(None, NOW_ROS_S, NOW_S, "/q") == NOW_S
    assert measured_at(Stamp(0), NOW_ROS_S, NOW_S, "/q") == NOW_S


def test_a_clock_that_is_ahead_measures_nothing_in_the_future() -> None:
    assert measured_at(Stamp(1_800_000_000, 5 * 10**8), NOW_ROS_S, NOW_S, "/q") == NOW_S


@pytest.mark.parametrize("away_s", [-2 * PAST_S, 2 * FUTURE_S])
def test_an_absurd_stamp_is_a_fault(away_s: float) -> None:
    stamp = Stamp(int(NOW_ROS_S + away_s))
    with pytest.raises(DeviceError, match=r"a message on /q is stamped .* it arrived"):
        measured_at(stamp, NOW_ROS_S, NOW_S, "/q")


def test_a_message_that_was_kept_may_be_old() -> None:
    assert measured_at(Stamp(1_700_000_000), NOW_ROS_S, NOW_S, "/map", latched=True) < -1e7


def test_time_that_jumps_back_is_told_once_and_waited_for_no_more() -> None:
    times = iter([5.0, 5.0, 5.2, 5.2, 0.1, 0.2, 0.3])
    failed: list[PlantError] = []
    clock = RosClock(lambda: next(times), lambda: True, failed.append)
    clock.wait(10.0)
    assert clock.now_s() == 5.2
    assert [str(error) for error in failed] == [
        "/clock jumped back from 5.2 s to 0.1 s: the simulation was reset"
    ]


def test_time_that_stands_still_is_waited_for_until_the_run_is_over() -> None:
    looks = iter([True, True, False])
    failed: list[PlantError] = []
    clock = RosClock(lambda: 3.0, lambda: next(looks), failed.append)
    clock.wait(1.0)
    assert next(looks, "no more") == "no more"
    assert not failed


def test_outputs_are_published_as_they_are_sent_and_states_as_they_change() -> None:
    told: list[tuple[str, Any]] = []
    topic = Ros2Topic("a.m.y.c.q", "~/a/m/y/c/q", "std_msgs/Float64", "scalar", "data")
    state = Ros2Topic("a.m", "~/a/m", "std_msgs/String", "scalar", "data")
    published = Ros2Published("a.m", "c_q", topic), Ros2Published("a.m", "", state)
    publishing = Publishing(published, lambda name, message: told.append((name, message["data"])))
    for stamp, name, value in ((0, "S0", 1.5), (1, "S0", None), (2, "S1", 2.5)):
        sent = (("c_q", value), ("c_other", 7))
        publishing.observe(StepRecord("a.m", stamp, stamp * 0.1, name, -1, sent))
    publishing.observe(StepRecord("a.c", 0, 0.0, "S0", -1, ()))
    changes = [json.loads(text) for name, text in told if name == "~/changes"]
    assert [data for name, data in told if name == topic.name] == [1.5, 2.5]
    assert [data for name, data in told if name == state.name] == ["S0", "S1"]
    assert changes[1] == {"subsystem": "a.m", "from": "S0", "to": "S1", "time_s": 0.2}
