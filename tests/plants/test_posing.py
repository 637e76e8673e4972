"""Poses that a position and a quaternion of the model become."""

from itertools import product

import numpy as np
import pytest
from specc_runtime.builtins import pose
from specc_runtime.distortion import Distortion
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco import MujocoPlant

from tests.commands import specc
from tests.plants.worlds import model_file

WORLD = """
<mujoco>
  <option timestep="0.002" gravity="0 0 0"/>
  <worldbody>
    <body name="base" pos="1 2 3" quat="0.5 0.5 0.5 0.5"/>
    <body name="box" pos="0.5 0 0"><freejoint name="box"/><geom size="0.1" mass="1"/>
      <site name="tip" pos="0 0 0.2" quat="0.8 0 0.6 0"/></body>
  </worldbody>
  <sensor>
    <framepos name="p" objtype="site" objname="tip" reftype="xbody" refname="base"/>
    <framequat name="q" objtype="site" objname="tip" reftype="xbody" refname="base"/>
    <framepos name="tip_p" objtype="site" objname="tip"/>
    <framequat name="tip_q" objtype="site" objname="tip"/>
    <framepos name="base_p" objtype="xbody" objname="base"/>
    <framequat name="base_q" objtype="xbody" objname="base"/>
    <gyro name="w" site="tip"/>
  </sensor>
  <keyframe><key name="home" qpos="0.5 0 0 0.48 0.6 0.64 0"/></keyframe>
</mujoco>
"""


def plant_of(folder, *bindings):
    return MujocoPlant(model_file(folder, WORLD), list(bindings))


def bound(name, *sensors, **more):
    return SensorBinding(name, sensors=sensors, is_pose=True, **more)


def angle(X):
    return np.arccos(np.clip((np.trace(X[:3, :3]) - 1) / 2, -1, 1))


def test_sensors_and_free_joints_give_poses_that_compose(tmp_path):
    """The tip in the base is the tip in the world, seen from the base in the world."""
    plant = plant_of(
        tmp_path,
        bound("relative", "p", "q"),
        bound("tip", "tip_p", "tip_q"),
        bound("base", "base_p", "base_q"),
        SensorBinding("box", joints=("box",), is_pose=True),
    )
    X_bt, X_wt, X_wb, X_wx = map(plant.sample, ("relative", "tip", "base", "box"))
    assert X_wb @ X_bt == pytest.approx(X_wt, abs=1e-12)
    X_xt = pose(np.array((0, 0, 0.2)), np.array((0, 0.6, 0, 0.8)))  # x, y, z, w
    assert X_wx @ X_xt == pytest.approx(X_wt, abs=1e-12)
    assert not X_wt.flags.writeable


def test_noise_of_a_pose_is_in_metres_and_radians(tmp_path):
    plant = plant_of(
        tmp_path, bound("X", "tip_p", "tip_q", noise=(0.01, 0.02)), bound("exact", "tip_p", "tip_q")
    )
    exact, samples = plant.sample("exact"), []
    for _ in range(2000):
        samples.append(np.array(plant.sample("X")))
        plant.advance(0.002)
    measured = np.array(samples)
    assert np.allclose(measured[:, :3, :3] @ measured[:, :3, :3].transpose(0, 2, 1), np.eye(3))
    assert measured[:, :3, 3].std(axis=0) == pytest.approx([0.01] * 3, rel=0.1)
    turned = exact[:3, :3].T @ measured[:, :3, :3]
    about = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1)
    assert about.std(axis=0) == pytest.approx([0.02] * 3, rel=0.1)


def test_a_bias_turns_about_the_axes_of_the_pose_and_a_scale_multiplies_the_angle(tmp_path):
    plant = plant_of(tmp_path, bound("X", "tip_p", "tip_q"))
    exact = np.array(plant.sample("X"))
    plant.advance(0.002)
    plant.distort("X", Distortion(bias=(0.1, 0.0, 0.0, 0.0, 0.0, np.pi / 2)))
    quarter = pose(np.zeros(3), np.array((0, 0, np.sqrt(0.5), np.sqrt(0.5))))
    biased = plant.sample("X")
    assert biased[:3, :3] == pytest.approx((exact @ quarter)[:3, :3], abs=1e-9)
    assert biased[:3, 3] - exact[:3, 3] == pytest.approx([0.1, 0, 0])
    plant.advance(0.002)
    plant.distort("X", Distortion(scale=(0.5,)))
    scaled = plant.sample("X")
    assert angle(scaled) == pytest.approx(angle(exact) / 2)
    assert scaled[:3, 3] == pytest.approx(exact[:3, 3] / 2)
    assert scaled[:3, :3] @ scaled[:3, :3] == pytest.approx(exact[:3, :3], abs=1e-9)


@pytest.mark.parametrize("sensors", [("p",), ("q", "p"), ("p", "w"), ("p", "q", "w")])
def test_other_sensors_give_no_pose(tmp_path, sensors):
    with pytest.raises(PlantError, match="a pose is measured by"):
        plant_of(tmp_path, bound("X", *sensors))


def test_every_turn_comes_back_from_its_angle(tmp_path):
    """A scale of 1 changes nothing, also near half a turn."""
    plant = plant_of(tmp_path, SensorBinding("box", joints=("box",), is_pose=True))
    for axis, turn in product(np.eye(3), (0.0, 1e-9, 1.0, 3.1, np.pi, 4.0, 6.2)):
        w, v = np.cos(turn / 2), np.sin(turn / 2) * axis
        plant._data.qpos[3:7] = w, *v
        plant.advance(0.002)
        plant.distort("box", None)
        exact = np.array(plant._sensors["box"]._take())
        plant.distort("box", Distortion())
        assert plant._sensors["box"]._take() == pytest.approx(exact, abs=1e-9)


TURNTABLE = """
<mujoco>
  <worldbody><body name="plate" pos="0 0 0.2">
    <joint name="turn" axis="0 0 1" damping="1"/>
    <geom type="cylinder" size="0.2 0.02" mass="1"/><site name="mark" pos="0.1 0 0"/>
  </body></worldbody>
  <actuator><position name="drive" joint="turn" kp="20"/></actuator>
  <sensor><framepos name="p" objtype="site" objname="mark"/>
    <framequat name="q" objtype="site" objname="mark"/></sensor>
  <keyframe><key name="home" qpos="1.5707963267948966" ctrl="1.5707963267948966"/></keyframe>
</mujoco>
"""
TURNED = """
specc: 1.2
system: table
frames: {W: world, M: mark}
agents:
  table:
    real_receptors: {eye: {y: {X: "pose[W, M]", p: "vector[3, m]", q: "vector[4]"}}}
    virtual_receptors:
      eye:
        rate: 50 Hz
        x: {R: {X: "pose[W, M]", p: "vector[3, m]", q: "vector[4]"}}
        y: {c: {X: "pose[W, M]", Y: "pose[W, M]"}}
        through:
          y.c.X: x.R.X
          y.c.Y: "pose(x.R.p, [x.R.q[1], x.R.q[2], x.R.q[3], x.R.q[0]])"
    control:
      rate: 10 Hz
      x:
        eye: {X: {type: "pose[W, M]", init: identity()}, Y: {type: "pose[W, M]", init: identity()}}
      memory:
        one: {type: "point[W]", init: "[0, 0, 0]"}
        other: {type: "point[W]", init: "[0, 0, 0]"}
      through: {one: x.eye.X @ tip, other: x.eye.Y @ tip}
constants: {tip: {type: "point[M]", is: "[1[m], 0, 0]"}}
plant:
  model: model.xml
  bind:
    table.R.eye.X: {sensors: [p, q]}
    table.R.eye.p: {sensors: [p]}
    table.R.eye.q: {sensors: [q]}
require:
  - {that: "within(1[s], near(table.c.one, [0, 1.1[m], 0.2[m]], 1[mm]))", because: a quarter}
  - {that: "within(1[s], near(table.c.other, [0, 1.1[m], 0.2[m]], 1[mm]))", because: as well}
"""


def test_a_pose_that_is_bound_is_the_one_of_the_reordered_quaternion(tmp_path):
    model_file(tmp_path, TURNTABLE)
    (tmp_path / "table.yaml").write_text(TURNED)
    done = specc("run", "table.yaml", "--duration", "2", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("met within") == 2
