"""Blocked joints: they stay where they are, and the rest moves as if they were welded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from specc_runtime.plants.binding import ActuatorBinding, SensorBinding
from specc_runtime.plants.mujoco import MujocoPlant

CART = """
<mujoco><option timestep="0.01"/><worldbody>
  <body><joint name="x" type="slide" axis="1 0 0"/><geom size="0.1" mass="{mass}"/></body>
</worldbody><actuator><motor name="drive" joint="x"/></actuator></mujoco>
"""
ARM = """
<mujoco><option timestep="0.002"/><worldbody>
  <body>{shoulder}<geom type="box" pos="0.25 0 0" size="0.3 0.2 0.04" mass="2"/>
    <body pos="0.6 0 0"><joint name="elbow" axis="0 1 0" stiffness="8" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.5 0 0" size="0.04" mass="1" contype="0" conaffinity="0"/>
    </body></body>
  <body pos="0.3 0 0.2"><freejoint name="box"/>
    <geom type="box" size="0.05 0.05 0.05" mass="0.5"/></body>
</worldbody></mujoco>
"""
BOX = """
<mujoco><compiler angle="radian"/><worldbody><body euler="{tilt} 0 0.7">
  <freejoint name="box"/><geom type="box" size="0.1 0.1 0.1"/></body></worldbody></mujoco>
"""
TRAIN = """
<mujoco><option timestep="0.01" gravity="0 0 0"/><worldbody>
  <body><joint name="x" type="slide" axis="1 0 0"/><geom size="0.1" mass="3"/>
    <body pos="0 0 1"><joint name="load" type="slide" axis="1 0 0"/>
      <geom size="0.1" mass="2"/></body>
  </body>
</worldbody><actuator><motor name="drive" joint="x"/></actuator></mujoco>
"""


def plant_of(folder: Path, model: str, *joints: str, driven: bool = True) -> MujocoPlant:
    """A plant whose joints can be sampled by their names."""
    (folder / "model.xml").write_text(model)
    sensors = [SensorBinding(joint, joints=(joint,)) for joint in joints]
    drives = [ActuatorBinding("drive", ("drive",))] if driven else []
    return MujocoPlant(str(folder / "model.xml"), sensors, drives)


@pytest.mark.parametrize(("mass", "force"), [(1, 50.0), (1000, 1e5), (0.001, 1e4)])
def test_a_blocked_joint_holds_and_is_free_again(tmp_path: Path, mass: float, force: float) -> None:
    plant = plant_of(tmp_path, CART.format(mass=mass), "x")
    plant.put({"x": 0.87})
    plant.block("x", True)
    plant.actuate("drive", force)
    for _ in range(30):
        plant.advance(1.0)
        assert plant.sample("x") == 0.87
    plant.block("x", False)
    plant.advance(0.1)
    moved = force / mass * 0.01 * 0.01 * 10 * 11 / 2  # ten steps of 10 ms
    assert plant.sample("x") == pytest.approx(0.87 + moved)


def test_the_rest_moves_as_if_it_were_welded(tmp_path: Path) -> None:
    """An elbow swings on a blocked shoulder, and a box falls upon it."""
    seen = []
    for shoulder in ("", '<joint name="shoulder" axis="0 1 0"/>'):
        plant = plant_of(tmp_path, ARM.format(shoulder=shoulder), "elbow", "box", driven=False)
        if shoulder:
            plant.block("shoulder", True)
        moves = []
        for _ in range(100):
            plant.advance(0.02)
            moves.append([plant.sample("elbow"), *plant.sample("box")])
        seen.append(np.array(moves))
    assert np.ptp(seen[0][:, 0]) > 0.5
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-4)


def test_what_stops_at_once_lets_the_rest_go_on(tmp_path: Path) -> None:
    plant = plant_of(tmp_path, TRAIN, "x", "load")
    plant.actuate("drive", 5.0)
    plant.advance(1.0)  # 3 kg are driven alone; the load keeps its place
    plant.actuate("drive", 0.0)
    x, load = plant.sample("x"), plant.sample("load")
    assert x + load == pytest.approx(0.0, abs=1e-9)
    plant.block("x", True)
    plant.advance(1.0)
    assert plant.sample("x") == x
    assert plant.sample("load") == pytest.approx(load, abs=1e-3)


def test_what_is_put_somewhere_is_blocked_there(tmp_path: Path) -> None:
    plant = plant_of(tmp_path, CART.format(mass=1), "x")
    plant.block("x", True)
    plant.shift({"x": 0.5})
    plant.advance(1.0)
    assert plant.sample("x") == 0.5


@pytest.mark.parametrize("tilt", [0.0, 1.2])
def test_a_free_joint_is_put_at_a_yaw_and_shifted_by_one(tmp_path: Path, tilt: float) -> None:
    """However it lies, its axis points where it pointed in the model, turned by the yaw."""
    plant = plant_of(tmp_path, BOX.format(tilt=tilt), "box", driven=False)

    def heading() -> float:
        plant.advance(0.002)
        w, x, y, z = plant.sample("box")[3:]
        return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))

    first = heading()
    for _ in range(2):
        plant.put({"box.yaw": 1.0})
        assert heading() - first == pytest.approx(1.0)
    plant.shift({"box.yaw": 0.5})
    assert heading() - first == pytest.approx(1.5)
    plant.put({"box.yaw": 0.0})
    assert heading() == pytest.approx(first)


def test_a_reset_releases(tmp_path: Path) -> None:
    plant = plant_of(tmp_path, CART.format(mass=1), "x")
    plant.block("x", True)
    plant.reset(0)
    plant.actuate("drive", 1.0)
    plant.advance(1.0)
    assert plant.sample("x") == pytest.approx(0.505)
