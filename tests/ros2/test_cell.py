"""A simulated cell that others in ROS command: with stubs in the place of its node, and really."""

from __future__ import annotations

import os
import runpy
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from specc_runtime.distortion import Distortable
from specc_runtime.environment import made_plant
from specc_runtime.examination import shortcomings
from specc_runtime.hosting.client import Setup
from specc_runtime.loading import load_system, timed
from specc_runtime.options import Options, UsageError
from specc_runtime.plant import Guarded
from specc_runtime.plants.errors import PlantError
from specc_runtime.ros2.binding import Ros2, Ros2Topic
from specc_runtime.ros2.cell import SimulatedCell, simulated_cell
from specc_runtime.ros2.plant import Ros2Plant, ros2_plant
from specc_runtime.savable import Savable
from specc_runtime.system import System

from specc.cli import main
from tests.hosting.rig import DEVICES, HERE, log, system, until
from tests.ros2.conftest import PYTHONS, Start, lines
from tests.scenarios.runs import INSTALLED, SPECS

SIMULATED, OF_NODE = "a.E.arm", "a.E.desk"
TOPICS = (
    Ros2Topic(f"{OF_NODE}.q", "/q", "std_msgs/Float64", "scalar", "data"),
    Ros2Topic(f"{OF_NODE}.u", "/u", "std_msgs/Float64", "scalar", "data", commanded=True),
)


class Simulation:
    """Notes what it is asked."""

    simulated = True
    truth = "the truth"

    def __init__(self) -> None:
        self.calls: list[Any] = []

    def reset(self, seed: int) -> None:
        self.calls.append(("reset", seed))

    def sample(self, name: str) -> float:
        assert name == f"{SIMULATED}.q"
        return 1.0

    def actuate(self, name: str, value: Any) -> None:
        self.calls.append((name, value))

    def advance(self, duration_s: float) -> None:
        self.calls.append(duration_s)

    def distort(self, element: str, distortion: object) -> None:
        self.calls.append(element)

    def saved(self) -> None: ...

    def restore(self, saved: object) -> None: ...

    def close(self) -> None:
        self.calls.append("closed")


def cell(**of_ros2: Any) -> System:
    made = system(SIMULATED, OF_NODE, silence_s=5.0)
    assert made.plant is not None
    plant = replace(made.plant, python=f"{__name__}:Simulation", ros2=Ros2("n", TOPICS, **of_ros2))
    return replace(made, plant=plant)


def test_each_element_has_one_behind_it_and_a_last_will_is_for_the_node(tmp_path: Path) -> None:
    setup = Setup(
        DEVICES, {"log": str(tmp_path / "log"), "values": {f"{OF_NODE}.q": 2.0}}, (str(HERE),)
    )
    built, simulation = cell(), Simulation()
    node = Ros2Plant(built, setup, decode={}, encode={})
    made = SimulatedCell(simulation, node, frozenset(topic.name for topic in TOPICS))
    assert not shortcomings(made, Guarded)
    assert shortcomings(made, Savable)
    assert not shortcomings(made.behind(f"{SIMULATED}.q"), Distortable)
    assert shortcomings(made.behind(f"{OF_NODE}.q"), Distortable)
    assert made.truth == "the truth"
    made.reset(3)
    assert (made.sample(f"{SIMULATED}.q"), made.sample(f"{OF_NODE}.q").value) == (1.0, 2.0)
    for device in (SIMULATED, OF_NODE):
        made.bequeath(device, {f"{device}.u": [("safe", 7.0)]})
        made.actuate(f"{device}.u", 4.0)
    made.advance(0.002)
    assert until(lambda: any(name == f"{OF_NODE}.u" for _, name, _ in log(tmp_path)))
    made.leave()
    made.actuate(f"{OF_NODE}.u", 5.0)
    made.close()
    assert simulation.calls == [("reset", 3), (f"{SIMULATED}.u", 4.0), 0.002, "closed"]
    sent = [(name, value) for _, name, value in log(tmp_path) if name.endswith(".u")]
    assert sent == [(f"{OF_NODE}.u", 4.0), (f"{OF_NODE}.u", 5.0)]


def test_the_simulation_is_closed_where_there_is_no_node() -> None:
    simulation = Simulation()
    with pytest.raises((PlantError, UsageError), match="no_such_python"):
        simulated_cell(simulation, lambda: ros2_plant(cell(python="no_such_python")), frozenset())
    assert simulation.calls == ["closed"]


def test_it_goes_on_as_the_clock_does_and_can_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    options = Options(directory=Path("built"))
    assert timed(replace(options, viewer=True), cell()).real_time
    with pytest.raises(UsageError, match="--speed"):
        timed(replace(options, speed=1.0), cell())
    monkeypatch.setattr(Simulation, "simulated", False)
    with pytest.raises(UsageError, match="simulated = True"):
        made_plant(cell(), replace(options, real_time=True))
    with pytest.raises(UsageError, match="--bag"):
        timed(replace(options, bag=Path("bag.mcap")), cell())


SKILL = SPECS / "examples" / "pick_cubes.yaml"


@INSTALLED
def test_it_is_packed_with_its_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["build", str(SKILL), "--ament", str(tmp_path)]) == 0
    monkeypatch.setattr(sys, "argv", ["pick_cubes"])
    with patch("specc_runtime.main.run", return_value=0) as run:
        runpy.run_path(str(tmp_path / "pick_cubes_agents" / "main.py"))["main"]()
    (options,) = run.call_args.args
    plant = load_system(options.directory, options.base).plant
    assert plant is not None
    assert (Path(options.base) / plant.model).is_file()


@INSTALLED
@pytest.mark.long
@pytest.mark.no_replay("it replays its own recording")
@pytest.mark.parametrize("ros", PYTHONS[-1:] or [""], indirect=True)
def test_a_simulated_cell_is_commanded_and_called_off(
    arm: Start,
    ros: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("PATH", os.pathsep.join((os.path.dirname(ros), os.environ["PATH"])))
    record = tmp_path / "run.mcap"
    command = [sys.executable, "-m", "specc", "run", str(SKILL), "--duration", "100"]
    with subprocess.Popen([*command, "--record", str(record)], stdout=subprocess.DEVNULL) as run:
        orders = "9", "1", "2@lifting", "1"
        client = arm("customer", "/pick_cubes", "/pick_cubes/panda/c", *orders, program="nodes.py")
        said = lines(client, "done", 80.0)
        run.send_signal(signal.SIGINT)
    assert said == [
        "9 rejected",
        "1 succeeded 0 1 [1]",
        "2@lifting canceled 0 [0]",
        "1 succeeded 0 1 [1]",
        "done",
    ]
    assert run.returncode == 130
    assert main(["replay", str(record), "--spec", str(SKILL)]) == 0
    out = capsys.readouterr().out
    assert all(f"{name}: " in out and "the same" in out for name in ("desk.c", "panda.c"))
