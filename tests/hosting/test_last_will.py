"""Whoever ends first, in whatever way, devices get their safe outputs, and nobody stays behind."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import pytest
from specc_runtime.clock import WallClock
from specc_runtime.safety import SafeOutputs, hand_over, leave_safe

from tests.hosting.rig import log, until

ROOT = Path(__file__).parents[2]
A, B = "a.E.d.u", "b.E.d.u"


class Agent:
    """The process of `agent.py`, and the host that it started."""

    def __init__(self, folder: Path, **config: Any) -> None:
        self.folder = folder
        command = [sys.executable, "-m", "tests.hosting.agent", str(folder)]
        self.process = subprocess.Popen(
            [*command, *(f"{name}={value}" for name, value in config.items())],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdout is not None
        self.host = int(self.process.stdout.readline())
        assert until(lambda: len(log(folder)) > 8)

    def send(self, number: int) -> None:
        self.process.send_signal(number)

    def said(self) -> list[str]:
        return self.process.communicate(timeout=30)[0].splitlines()

    def noted(self) -> list[tuple[str, Any]]:
        return [(name, value) for _, name, value in log(self.folder)]

    def host_is_gone(self) -> bool:
        return not Path(f"/proc/{self.host}").exists()

    def close(self) -> None:
        for pid in (self.process.pid, self.host):
            try:
                os.kill(pid, signal.SIGCONT)
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        self.process.communicate()


@pytest.fixture
def agent(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Agent]:
    made = Agent(tmp_path, **getattr(request, "param", {}))
    yield made
    made.close()


def config(**settings: Any) -> Any:
    return pytest.mark.parametrize("agent", [settings], indirect=True)


def fails(**how: str) -> Any:
    return config(fails=json.dumps({name.replace("_", " ", 1): why for name, why in how.items()}))


@pytest.mark.long
def test_an_agent_that_is_killed(agent: Agent) -> None:
    agent.send(signal.SIGKILL)
    assert until(lambda: agent.noted()[-1] == ("close", None))
    assert sorted(agent.noted()[-3:-1]) == [(A, "safe"), (B, "safe")]
    assert until(agent.host_is_gone)


@pytest.mark.long
@pytest.mark.parametrize(
    ("agent", "devices"),
    [
        ({"fails": json.dumps({f"send {A}": "hang"})}, [B]),
        ({"fails": json.dumps({f"sent {A}": "hang"})}, [B]),
        ({"fails": json.dumps({"close": "hang"})}, [A, B]),
    ],
    indirect=["agent"],
)
def test_a_device_that_hangs_keeps_no_other_from_its_will(agent: Agent, devices: list[str]) -> None:
    agent.send(signal.SIGKILL)
    assert until(lambda: agent.noted()[-1] == ("close", None))
    given = {name for name, value in agent.noted() if value == "safe"}
    assert given >= set(devices)
    assert until(agent.host_is_gone)


@pytest.mark.long
def test_an_agent_that_is_stopped_and_killed(agent: Agent) -> None:
    agent.send(signal.SIGSTOP)
    assert until(lambda: {(A, "safe"), (B, "safe")} <= set(agent.noted()))
    before = agent.noted()
    agent.send(signal.SIGKILL)
    assert until(agent.host_is_gone)
    assert agent.noted() == [*before, ("close", None)]


@pytest.mark.long
def test_an_agent_that_comes_back_ends_with_a_fault(agent: Agent) -> None:
    agent.send(signal.SIGSTOP)
    assert until(lambda: {(A, "safe"), (B, "safe")} <= set(agent.noted()))
    agent.send(signal.SIGCONT)
    why, *rest = agent.said()
    assert why.startswith(("a.E.d got", "b.E.d got")) and why.endswith("its `silence` is 0.04 s")
    assert rest == ["over"]
    assert ("late" not in {value for _, value in agent.noted()}) and agent.process.returncode == 0
    assert agent.noted()[-3:] == [(A, "left"), (B, "left"), ("close", None)]


@pytest.mark.long
@config(silence=5.0)
def test_an_agent_that_is_stopped_for_less_than_the_silence_goes_on(agent: Agent) -> None:
    agent.send(signal.SIGSTOP)
    assert until(lambda: True, 0.1)
    agent.send(signal.SIGCONT)
    seen = len(agent.noted())
    assert until(lambda: len(agent.noted()) > seen + 10)
    assert ("safe" not in {value for _, value in agent.noted()}) and agent.process.poll() is None


@pytest.mark.long
def test_a_host_that_is_killed(agent: Agent) -> None:
    os.kill(agent.host, signal.SIGKILL)
    assert agent.process.stdout is not None
    assert agent.process.stdout.readline().startswith("the device host ended: killed by SIGKILL")


@pytest.mark.long
@config(lasts=0.2)
def test_an_agent_that_ends_voids_its_will(agent: Agent) -> None:
    assert agent.said() == ["over"]
    assert agent.noted()[-3:] == [(A, "left"), (B, "left"), ("close", None)]
    assert "safe" not in {value for _, value in agent.noted()}
    assert until(agent.host_is_gone)


@pytest.mark.long
@config(lasts=0.2, pause=0.2)
def test_an_agent_that_waits_for_its_last_steps_gives_safe_outputs_after_its_will(
    agent: Agent,
) -> None:
    assert agent.said() == ["over"]
    assert {(A, "safe"), (B, "safe")} <= set(agent.noted())
    assert agent.noted()[-3:] == [(A, "left"), (B, "left"), ("close", None)]


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGTSTP])
def test_a_host_stays_until_its_agent_is_gone(agent: Agent, number: int) -> None:
    os.kill(agent.host, number)
    agent.send(signal.SIGKILL)
    assert until(lambda: agent.noted()[-1] == ("close", None))
    assert sorted(agent.noted()[-3:-1]) == [(A, "safe"), (B, "safe")]
    assert until(agent.host_is_gone)


# What is handed over, and when.


class Plant:
    """Notes what it inherits."""

    def __init__(self) -> None:
        self.bequeathed: list[tuple[str, Mapping[str, Sequence[tuple[str, Any]]]]] = []
        self.calls: list[str] = []

    def inherit(self, will: Any) -> None:
        self.will = will
        will()

    def bequeath(self, device: str, will: Mapping[str, Sequence[tuple[str, Any]]]) -> None:
        self.bequeathed.append((device, will))

    def leave(self) -> None:
        self.calls.append("leave")

    def actuate(self, name: str, value: Any) -> None:
        self.calls.append(f"{name} {value}")


class Drive(SafeOutputs):
    name = "a.E.d"
    elements = ("u",)
    reports: ClassVar[Mapping[str, str]] = {"q": "q"}

    def __init__(self) -> None:
        self.memory = type("Samples", (), {})()
        self.asked = 0
        self.clock: Clock | None = None

    def safe_u(self) -> float:
        self.asked += 1
        if self.clock is not None:
            self.clock.time_s += 1.0
        return 2.0 * self.memory.q

    def otherwise_u(self) -> float:
        return 7.0


class Reported:
    def __init__(self, value: Any = 0.0, count: int = 0) -> None:
        self.value, self.count = value, count


class Clock(WallClock):
    """Every look at it takes a microsecond, and more while somebody computes."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        self.time_s += 1e-6
        return self.time_s


def heir(plant: Any, drive: Any, sensor: Any, clock: Clock) -> None:
    hand_over((drive,), plant, {"a.E.d.q": sensor}, clock)


def test_the_will_follows_what_devices_report() -> None:
    plant, drive, sensor, clock = Plant(), Drive(), Reported(), Clock()
    heir(plant, drive, sensor, clock)
    for value in (1.0, 1.5):
        sensor.value, sensor.count = value, sensor.count + 1
        clock.time_s += 1.0
        plant.will()
        plant.will()
    expected = [[("safe", 2.0 * value), ("otherwise", 7.0)] for value in (0.0, 1.0, 1.5)]
    assert [will for _, will in plant.bequeathed] == [{"a.E.d.u": values} for values in expected]
    assert {device for device, _ in plant.bequeathed} == {"a.E.d"}


@pytest.mark.parametrize("value", [None, float("nan"), "text"])
def test_what_cannot_be_computed_is_not_in_the_will(value: Any) -> None:
    plant, drive, sensor = Plant(), Drive(), Reported(value, 1)
    heir(plant, drive, sensor, Clock())
    values = dict(plant.bequeathed)["a.E.d"]["a.E.d.u"]
    assert values[-1] == ("otherwise", 7.0) and (len(values) == 1 or value == "text")


def test_what_takes_long_is_computed_less_often() -> None:
    plant, drive, sensor, clock = Plant(), Drive(), Reported(), Clock()
    drive.clock = clock
    heir(plant, drive, sensor, clock)
    begin_s = clock.time_s
    while clock.time_s < begin_s + 100.0:
        sensor.count += 1
        plant.will()
        clock.time_s += 0.01
    assert drive.asked == 6


def test_a_plant_that_gives_safe_outputs_itself_is_told_that_the_agent_does() -> None:
    plant: Any = Plant()
    sensor: Any = Reported(3.0)
    leave_safe((Drive(),), plant, {"a.E.d.q": sensor}, {})
    assert plant.calls == ["leave", "a.E.d.u 6.0"]
