"""What others ask constants to be, and what they are told, without ROS."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from specc_runtime.faults import Fault
from specc_runtime.live import Change
from specc_runtime.loading import timed
from specc_runtime.options import Options, UsageError
from specc_runtime.records import StepRecord
from specc_runtime.ros2.binding import DIAGNOSTICS, Ros2
from specc_runtime.ros2.constants import Constants, constants_config
from specc_runtime.ros2.diagnosing import ERROR, OK, PERIOD_S, WARN, Diagnosing
from specc_runtime.system import LiveConstant

from specc import pipeline
from tests.ros2.conftest import HERE
from tests.ros2.test_plant import behind

V = LiveConstant("v", 0.2, 0.0, 1.0, "m/s", title="speed")
N = LiveConstant("n", 3, 1, 5)


class Run:
    """A run that makes changes when it is told to."""

    def __init__(self) -> None:
        self.live = {"v": 0.2, "n": 3}
        self.asked: list[tuple[str, float, str]] = []

    def set_constant(self, name: str, value: float, by: str) -> None:
        self.asked.append((name, value, by))

    def tick(self, constants: Constants) -> None:
        for name, value, by in self.asked:
            constants.changed(Change(1, name, value, by))
        self.asked.clear()


def test_a_request_is_made_once_and_acknowledged_when_it_has_taken_effect() -> None:
    run, told = Run(), list[Any]()
    constants = Constants(run, told.append)  # type: ignore[arg-type]  # all that is asked of it
    constants.take({"v": (1, 0.5)})
    constants.take({"v": (1, 0.5)})
    assert run.asked == [("v", 0.5, "parameter")]
    constants.tell()  # ticks were skipped: it has not taken effect yet
    assert not told
    run.tick(constants)
    constants.tell()
    assert told == [{"v": (1, 0.5), "n": (0, 3)}]
    constants.take({"v": (3, 0.7)})
    run.set_constant("n", 5, "page")
    assert len(told) == 1
    run.tick(constants)
    constants.tell()
    constants.tell()
    assert told[1:] == [{"v": (3, 0.7), "n": (0, 5)}]


def test_the_node_is_told_of_the_constants() -> None:
    of_v, of_n = constants_config((V, N))
    assert of_v["title"] == "speed" and of_v["unit"] == "m/s" and type(of_v["value"]) is float
    assert type(of_n["value"]) is int and (of_n["least"], of_n["greatest"]) == (1, 5)


def test_a_parameter_that_is_no_live_constant_is_refused(tmp_path: Any) -> None:
    system = replace(behind(Ros2("n")), live=(V, N))
    for given in (("-p", "v:=0.3"), ("--param", "n:n:=2"), ("-r", "w:=1", "--params-file", "w:=2")):
        assert timed(Options(tmp_path, ros_args=given), system).real_time
    with pytest.raises(UsageError, match="w is no constant that may change; there are: v, n"):
        timed(Options(tmp_path, ros_args=("-p", "w:=1")), system)


def test_generated_code_has_titles_and_diagnostics(monkeypatch: pytest.MonkeyPatch) -> None:
    built = pipeline.build(str(HERE / "tuned.yaml"), {}, publish=("diagnostics",))
    code = built.files["system.py"]
    assert "diagnostics=True" in code and "published=" not in code
    assert 'title="speed of the belt"' in code
    wrong = pipeline.build(str(HERE / "tuned.yaml"), {}, publish=("diagnostic",))
    (found,) = [each for each in wrong.result.diagnostics if each.code == "E0521"]
    assert found.help == "did you mean `diagnostics`?"


def test_diagnostics_are_a_topic_of_their_own() -> None:
    assert Ros2("n", diagnostics=True).config["published"] == [DIAGNOSTICS.config]


def test_levels_are_those_of_the_last_second(monkeypatch: pytest.MonkeyPatch) -> None:
    told, clock = list[Any](), iter(range(10))
    monkeypatch.setattr("time.monotonic", lambda: PERIOD_S * next(clock))
    system = behind(Ros2("n"))
    (name,) = [each.subsystem.name for each in system.subsystems]
    late, skipped = {name: (0.0, 0)}, {name: 0}
    run: Any = SimpleNamespace(
        time_s=2.0,
        faults=[],
        late=lambda: late,
        skipped=lambda: skipped,
        entered=lambda: {name: 0.5},
        ages=lambda: {"a.E.d.q": 0.1},
    )
    diagnosing = Diagnosing(system, told.append)
    diagnosing.observe(StepRecord(name, 1, 1.0, "S1", -1, ()))
    diagnosing.look(run)
    assert not told
    diagnosing.look(run)
    late[name] = (0.75 * system.tick_s, 0)
    diagnosing.look(run)
    skipped[name] = 3
    diagnosing.look(run)
    late[name] = (1.5 * system.tick_s, 0)
    diagnosing.look(run)
    diagnosing.end(run)
    run.faults.append(Fault(name, "S1", "it broke"))
    diagnosing.end(run)
    statuses = [each["status"][0] for each in told]
    assert [each["level"] for each in statuses] == [OK, OK, WARN, WARN, ERROR]
    assert "it broke" in statuses[-1]["message"] and statuses[0]["hardware_id"] == system.name
    values = {each["key"]: each["value"] for each in statuses[2]["values"]}
    assert values["state"] == "S1" and values["skipped periods"] == "3"
    assert values["time in state (s)"] == "1.500"
    assert [value for key, value in values.items() if key.startswith("age of")] == ["100.0"]
