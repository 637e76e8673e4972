"""Devices between amplifiers, encoders and the joints of the model."""

import numpy as np
import pytest
from specc_runtime.cells.irp6_picking import PickingScene, PickJudge, devices
from specc_runtime.operators import dynamics, irp6, motors
from specc_runtime.plants.mujoco import MujocoPlant

from tests.plants.scripted_pick import ACTUATORS, SENSORS, pick
from tests.plants.worlds import PICKING


@pytest.fixture(scope="module")
def plant():
    return MujocoPlant(PICKING, SENSORS, ACTUATORS)


def hold(plant, seconds, gripper_A=0.0):
    """The arm stands against gravity without a regulator; the gripper carries a current."""
    arm = dynamics.load_arm(PICKING)
    for _ in range(round(seconds / 0.002)):
        plant.actuate("c", dynamics.gravity_feedforward(plant.sample("q"), arm))
        plant.actuate("c_g", gripper_A)
        plant.advance(0.002)


def test_drives_lose_no_power():
    """Power at the joints is power at the motors: tau . dq = kt i . dm."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        q = rng.uniform(irp6.JOINT_LOWER, irp6.JOINT_UPPER)
        dq, currents = rng.uniform(-1, 1, 6), rng.uniform(-1, 1, 6)
        h = 1e-6
        dm = (motors.joint_to_motor(q + h * dq) - motors.joint_to_motor(q - h * dq)) / (2 * h)
        torques = devices.drive_torques(currents, np.concatenate((q, dq)))
        assert torques @ dq == pytest.approx(irp6.TORQUE_CONSTANT * currents @ dm, rel=1e-5)


def test_amplifiers_carry_no_more_than_their_largest_current():
    q = np.array([0.0, -1.5, 0.0, 0.0, 4.7, -1.5])
    largest = np.array([gains[-1] for gains in irp6.ARM_GAINS]) / 1000.0
    much = devices.drive_torques(10 * largest, q)
    assert much == pytest.approx(devices.drive_torques(largest, q))
    assert devices.drive_torques(-10 * largest, q) == pytest.approx(-much)


def test_measured_motor_positions_are_those_of_the_joints(plant):
    plant.reset(0)
    assert plant.sample("m") == pytest.approx(motors.joint_to_motor(plant.sample("q")))


def test_a_hand_at_rest_reads_its_weight_pointing_down(plant):
    plant.reset(0)
    hold(plant, 0.5)
    wrench = plant.sample("F")
    X_BS = plant.truth.site_pose("wrist_ft")
    weight = np.array((0.0, 0.0, -irp6.TOOL_WEIGHT_N))
    assert X_BS[:3, :3] @ wrench[:3] == pytest.approx(weight, abs=0.02)
    # The sensor is turned by -90 degrees about the tool axis: x of the wrist is y of the sensor.
    lever = np.array(irp6.TOOL_COM_IN_WRIST) - (0.0, 0.0, irp6.SENSOR_HEIGHT)
    lever_S = np.array((-lever[1], lever[0], lever[2]))
    assert wrench[3:] == pytest.approx(np.cross(lever_S, wrench[:3]), abs=2e-3)


@pytest.mark.parametrize("current", [0.03, -0.03])
def test_the_gripper_rests_below_the_current_of_free_running(plant, current):
    plant.reset(0)
    hold(plant, 0.3, current)
    assert plant.sample("d") == pytest.approx(0.074, abs=1e-5)


@pytest.mark.parametrize(("current", "direction"), [(0.06, -1), (-0.06, 1)])
def test_a_positive_current_closes_the_gripper(plant, current, direction):
    plant.reset(0)
    hold(plant, 0.3, current)
    assert direction * (plant.sample("d") - 0.074) > 1e-3
    assert plant.sample("i_g") == pytest.approx(current)
    assert direction * plant.sample("g") < 0


def test_fingers_move_together(plant):
    plant.reset(0)
    hold(plant, 0.5, -0.1)
    left, right = (plant.truth.joint_position(f) for f in ("finger_l", "finger_r"))
    assert left == pytest.approx(right, abs=2e-5)


@pytest.mark.long
def test_a_stalled_gripper_presses_with_the_current_above_free_running(plant):
    """40 N at 100 mA, which hold a box and cancel in its force on the whole hand."""
    plant.reset(0)
    PickingScene().place(plant, np.random.default_rng(0))
    pick(plant, PickJudge(plant), "sen")
    for current in np.linspace(0.0, 0.1, 100):  # slowly: friction keeps what momentum has pressed
        hold(plant, 0.01, current)
    assert plant.truth.contact_force("finger_l") == pytest.approx(40.2, abs=1.0)
    assert plant.truth.contact_force("finger_r") == pytest.approx(40.2, abs=1.0)
    weight = 9.81 * 0.05
    assert plant.truth.contact_force("finger_l", "finger_r", "hand") == pytest.approx(weight, 0.1)
