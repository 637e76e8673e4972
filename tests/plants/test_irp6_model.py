"""The model file against published numbers; MuJoCo against pinocchio and the closed form."""

from math import pi

import mujoco
import numpy as np
import pytest
from specc_runtime.operators import dynamics, irp6, kinematics, motors
from specc_runtime.plants.mujoco import MujocoPlant

from tests.plants.worlds import PICKING

HOME = np.array([0.0, -pi / 2, 0.0, 0.0, 1.5 * pi, -pi / 2])


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_path(PICKING)


@pytest.fixture(scope="module")
def arm():
    return dynamics.load_arm(PICKING)


def configurations(count=100):
    rng = np.random.default_rng(0)
    return rng.uniform(irp6.JOINT_LOWER, irp6.JOINT_UPPER, (count, 6))


def at(model, q):
    data = mujoco.MjData(model)
    data.qpos[:6] = q
    mujoco.mj_forward(model, data)
    return data


def site_pose(data, name):
    X = np.eye(4)
    X[:3, :3] = data.site(name).xmat.reshape(3, 3)
    X[:3, 3] = data.site(name).xpos
    return X


def test_tool_is_where_the_closed_form_and_pinocchio_have_it(model, arm):
    for q in configurations():
        X_BE = site_pose(at(model, q), "tool")
        assert np.allclose(X_BE, kinematics.direct_kinematics(q), rtol=0, atol=1e-12)
        dynamics.pin.framesForwardKinematics(arm.model, arm.scratch, q)
        frame = arm.scratch.oMf[arm.model.getFrameId("tool")]
        assert np.allclose(X_BE, frame.homogeneous, rtol=0, atol=1e-12)


def test_pinocchio_feels_the_same_gravity(model, arm):
    for q in configurations():
        gravity = dynamics.pin.computeGeneralizedGravity(arm.model, arm.scratch, q)
        assert gravity == pytest.approx(at(model, q).qfrc_bias[:6], abs=1e-9)


def test_limits_are_those_of_the_controller(model):
    assert model.jnt_range[:6, 0] == pytest.approx(irp6.JOINT_LOWER)
    assert model.jnt_range[:6, 1] == pytest.approx(irp6.JOINT_UPPER)


def test_rotors_add_their_inertia_and_friction_on_the_motor_side(model):
    """dm/dq^T diag(J) dm/dq, exact at the front pose where the screws' ratios were taken."""
    N = motors.motor_ratio(HOME)
    data = at(model, HOME)
    with_rotors, without = np.zeros((model.nv, model.nv)), np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, with_rotors)
    bare = mujoco.MjModel.from_xml_path(PICKING)
    bare.dof_armature[:] = 0
    bare.tendon_armature[:] = 0
    mujoco.mj_fullM(bare, at(bare, HOME), without)
    inertia = (with_rotors - without)[:6, :6]
    assert inertia == pytest.approx(N.T @ np.diag(irp6.MOTOR_INERTIA) @ N, rel=2e-3, abs=2e-3)

    speeds = np.random.default_rng(1).uniform(-1, 1, 6)
    data.qvel[:6] = speeds
    mujoco.mj_forward(model, data)
    friction = N.T @ np.diag(irp6.MOTOR_DAMPING) @ N @ speeds
    assert -data.qfrc_damper[:6] == pytest.approx(friction, rel=2e-3, abs=1e-2)


def test_torque_ranges_hold_what_the_peak_currents_give(model):
    peak = np.array([gains[-1] for gains in irp6.ARM_GAINS]) / 1000.0
    largest = np.zeros(6)
    for q in configurations():
        largest = np.maximum(
            largest, np.abs(motors.motor_ratio(q)).T @ (irp6.TORQUE_CONSTANT * peak)
        )
    assert np.all(model.actuator_ctrlrange[:6, 1] >= largest)
    assert np.all(model.actuator_ctrlrange[:6, 1] <= 1.05 * largest)


def test_the_tool_weighs_what_was_published(model):
    data = at(model, HOME)
    data.qpos[6:8] = 0.037
    mujoco.mj_forward(model, data)
    parts = [model.body(name).id for name in ("hand", "finger_l", "finger_r")]
    mass = model.body_mass[parts]
    centre = mass @ data.xipos[parts] / mass.sum()
    wrist = data.body("tl_6")
    assert 9.81 * mass.sum() == pytest.approx(irp6.TOOL_WEIGHT_N, rel=1e-3)
    in_wrist = wrist.xmat.reshape(3, 3).T @ (centre - wrist.xpos)
    assert in_wrist == pytest.approx(irp6.TOOL_COM_IN_WRIST, abs=1e-5)


def test_fingertips_end_at_the_tool_frame_and_are_as_far_apart_as_their_joints_say(model):
    data = at(model, HOME)
    data.qpos[6:8] = 0.04
    mujoco.mj_kinematics(model, data)
    X_EB = np.linalg.inv(site_pose(data, "tool"))
    for name, side in (("finger_l_tip", 1.0), ("finger_r_tip", -1.0)):
        half = model.geom(name).size
        centre = X_EB[:3, :3] @ data.geom(name).xpos + X_EB[:3, 3]
        assert centre[2] + half[2] == pytest.approx(0.0, abs=1e-9)
        assert side * centre[1] - half[1] == pytest.approx(0.04)


def test_the_kinect_hangs_at_its_published_pose(model):
    """Optical frame: MuJoCo's camera frame turned by pi about x."""
    data = at(model, HOME)
    optical = data.cam("kinect").xmat.reshape(3, 3) @ np.diag([1, -1, -1])
    assert data.cam("kinect").xpos == pytest.approx([0.88317, -0.21239, 2.0291])
    assert optical[:, 2] == pytest.approx([-0.16549, -0.04335, -0.98526], abs=1e-5)
    assert optical[:, 0] == pytest.approx([0.00396, -0.99905, 0.04329], abs=1e-5)


def test_objects_are_the_boxes_that_are_drawn(model):
    """The invisible box that collides and the mesh that is seen are the same body's same shape."""
    for name in ("herbapol_mint_tea", "mnich", "sen"):
        mesh = model.mesh(name).id
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        skin = next(g for g in range(model.ngeom) if model.geom_dataid[g] == mesh)
        pose = np.zeros(9)
        mujoco.mju_quat2Mat(pose, model.geom_quat[skin])
        corners = model.mesh_vert[start : start + count] @ pose.reshape(3, 3).T
        corners += model.geom_pos[skin]
        assert corners.max(axis=0) == pytest.approx(model.geom(name).size, abs=1e-6)
        assert corners.min(axis=0) == pytest.approx(-model.geom(name).size, abs=1e-6)


def test_it_starts_at_home():
    plant = MujocoPlant(PICKING)
    assert plant.truth.site_pose("tool") == pytest.approx(kinematics.direct_kinematics(HOME))
    distance = sum(plant.truth.joint_position(f) for f in ("finger_l", "finger_r"))
    assert distance == pytest.approx(0.074)
