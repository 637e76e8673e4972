"""The plant behind ROS 2 with stubs in the place of the node: what it makes of what is reported."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.clock import WallClock
from specc_runtime.faults import DeviceFailed
from specc_runtime.hosting.client import Setup
from specc_runtime.loading import timed
from specc_runtime.options import Options, UsageError
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.ros2.binding import CLOCK, Ros2, Ros2Published, Ros2Topic
from specc_runtime.ros2.messages import value_of
from specc_runtime.ros2.plant import Ros2Plant, conversions
from specc_runtime.sampling import Sensor
from specc_runtime.system import System

from tests.hosting.rig import DEVICES, HERE, log, system, until

Q = "a.E.d.q"


def plant(folder: Path, ros2: Ros2, besides: tuple[str, ...] = (), **config: Any) -> Ros2Plant:
    """The plant of a system with one device, and stubs for its node."""
    made = behind(ros2)
    setup = Setup(DEVICES, {"log": str(folder / "log"), **config}, (str(HERE),), besides=besides)
    return Ros2Plant(made, setup, decode={}, encode={})


def behind(ros2: Ros2) -> System:
    made = system(sporadic=True)
    assert made.plant is not None
    return replace(made, plant=replace(made.plant, ros2=ros2))


def test_what_is_wrong_with_a_message_has_no_place_in_a_program(tmp_path: Path) -> None:
    topic = Ros2Topic(Q, "/q", "sensor_msgs/JointState", "joints", "position", joints=("q1",))
    made = plant(tmp_path, Ros2("n"), values={Q: {"name": ["q2"], "position": [0.0]}})
    made._decode[Q] = partial(value_of, topic)
    with pytest.raises(DeviceFailed, match="has no joint q1: it has q2") as raised:
        Sensor(SensorBinding(Q, sporadic=True), made.sample).update(0.0)
    assert raised.value.place == ""
    made.close()


def test_ages_are_counted_in_simulated_time_and_waiting_is_told(tmp_path: Path) -> None:
    ros2 = Ros2("n", use_sim_time=True)
    far_s = time.monotonic() + 500.0
    made = plant(tmp_path, ros2, (CLOCK,), values={Q: 1.0, CLOCK: far_s})
    looks = iter([False, False, True])
    told: list[list[str]] = []

    def is_over() -> bool:
        told.append(made.waits_for())
        return next(looks)

    pace = made.clock_of_run(WallClock(), is_over)
    assert pace.now_s() == far_s
    assert 490.0 < made.sample(Q).age_s < 500.0  # stubs measure by the clock of the machine
    assert made.waits_for() == []
    pace.wait(1.0)
    waits = f"the next tick is at {far_s + 1.0:.6g} s, and /clock is at {far_s:.6g} s"
    assert told[0] == [waits]
    made.close()


def test_the_end_is_not_kept_waiting_for_a_tick(tmp_path: Path) -> None:
    made = plant(tmp_path, Ros2("n"))
    looks = iter([False, True, True])
    waited_s: list[float] = []

    class Noting(WallClock):
        def wait(self, duration_s: float) -> None:
            waited_s.append(duration_s)

    made.clock_of_run(Noting(), lambda: next(looks)).wait(1000.0)
    assert 0.0 < sum(waited_s) < 1.0
    made.close()


def test_a_message_that_cannot_be_published_ends_no_run(tmp_path: Path) -> None:
    topic = Ros2Topic("~/a/d", "~/a/d", "std_msgs/Int64", "scalar", "data", commanded=True)
    ros2 = Ros2("n", published=(Ros2Published("a.d", "value", topic),))
    made = plant(tmp_path, ros2, fails={"send ~/a/d": "error"})
    made._publish("~/a/d", {"data": 2**70})

    def is_told() -> bool:
        made.advance(0.002)
        return bool(made._failures)

    assert until(is_told)
    made.advance(0.002)
    made.actuate("a.E.d.u", 1.0)
    assert until(lambda: log(tmp_path)[-1][1:] == ("a.E.d.u", 1.0))
    made.close()


def wrong(message: Any) -> float:
    return float(message["numbers"][7] if isinstance(message, dict) else message.numbers[7])


@pytest.mark.parametrize("commanded", [False, True])
def test_a_function_of_through_that_raises_is_blamed(*, commanded: bool) -> None:
    topic = Ros2Topic(Q, "/q", "cell_msgs/Q", "message", commanded=commanded)
    spec = behind(Ros2("n", (topic,))).plant
    assert spec is not None
    sensors = tuple(replace(sensor, through=wrong) for sensor in spec.sensors)
    convert = conversions(replace(spec, sensors=sensors))[commanded][Q]
    with pytest.raises(DeviceFailed, match="IndexError: list index out of range") as raised:
        convert({"numbers": [1.0]})
    assert raised.value.culprit == f"device {Q}, through {__name__}:wrong"
    assert raised.value.place.startswith("wrong (test_plant.py:")
    with pytest.raises(DeviceFailed, match="'numbers'") as raised:
        convert({})
    assert raised.value.place.startswith("wrong (test_plant.py:")


@pytest.mark.parametrize(
    ("option", "given"),
    [
        ("--speed", {"speed": 1.0}),
        ("--from", {"resume": (Path("run.mcap"), 1.0)}),
        ("--video", {"video": Path("run.mp4")}),
        ("--viewer", {"viewer": True}),
    ],
)
def test_what_no_robot_can_do_is_refused_before_it_is_asked(
    option: str, given: dict[str, Any]
) -> None:
    options, built = Options(directory=Path("built")), behind(Ros2("n"))
    assert timed(options, built).real_time
    with pytest.raises(UsageError, match=option):
        timed(replace(options, **given), built)
