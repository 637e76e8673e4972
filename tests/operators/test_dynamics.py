"""GF: against the potential energy of the published chain, and what load_arm refuses."""

import struct
from pathlib import Path

import numpy as np
import pytest
from specc_runtime.operators.dynamics import (
    decode_arm,
    encode_arm,
    gravity_feedforward,
    load_arm,
)
from specc_runtime.operators.motors import motor_ratio

from tests.operators.irp6_chain import FRONT, LOWER, UPPER, link_poses

PLANT = Path(__file__).parents[2] / "specs" / "plants" / "irp6_picking.xml"
MASSES = (40.0, 12.0, 11.0, 3.0, 2.0, 1.2)
CENTRES = ((-0.07, 0, 0.25), (0.2, 0, 0), (0, 0.3, 0), (0, 0.05, 0), (0, 0, 0.12), (0, 0, 0.03))
TOOL_MASS, TOOL_CENTRE = 1.344, (0.004, 0, 0.13)


@pytest.fixture(scope="module")
def arm():
    return load_arm(str(PLANT))


def potential_energy(q):
    poses = link_poses(q)
    bodies = [*zip(poses, MASSES, CENTRES, strict=True), (poses[-1], TOOL_MASS, TOOL_CENTRE)]
    return sum(9.81 * mass * (pose @ [*centre, 1.0])[2] for pose, mass, centre in bodies)


def test_currents_balance_the_gradient_of_the_potential_energy(arm):
    rng = np.random.default_rng(1)
    step = 1e-5
    for q in rng.uniform(LOWER, UPPER, (50, 6)):
        gravity = [
            (potential_energy(q + step * e) - potential_energy(q - step * e)) / (2 * step)
            for e in np.eye(6)
        ]
        held = motor_ratio(q).T @ (0.105 * gravity_feedforward(q, arm))
        assert held == pytest.approx(gravity, abs=1e-3)


def test_arm_can_hold_itself_at_the_front_pose(arm):
    currents = gravity_feedforward(FRONT, arm)

    assert (np.abs(currents) < [20.0, 15.0, 18.0, 15.0, 8.0, 1.0]).all()
    assert abs(currents[2]) > 2.0  # the upper arm is horizontal


def test_an_arm_comes_back_from_its_bytes(arm):
    data = encode_arm(arm)
    again = decode_arm(data)

    assert encode_arm(again) == data
    for q in np.random.default_rng(2).uniform(LOWER, UPPER, (50, 6)):
        assert gravity_feedforward(q, again).tobytes() == gravity_feedforward(q, arm).tobytes()


@pytest.mark.parametrize("size", [0, 8, 24, 800])
def test_bytes_that_are_no_arm(size):
    with pytest.raises(struct.error):
        decode_arm(bytes(size))


LINK = """<body name="link_{0}" pos="0 0 0.1"><joint name="{0}" type="hinge" axis="0 1 0"/>
<inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/>"""


def chain_file(path, names):
    bodies = "".join(LINK.format(name) for name in names) + "</body>" * len(names)
    path.write_text(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>")
    return str(path)


def test_other_joints_are_locked(tmp_path):
    path = chain_file(tmp_path / "arm.xml", ["q1", "q2", "q3", "q4", "q5", "q6", "finger"])

    assert gravity_feedforward(np.full(6, 0.1), load_arm(path)).shape == (6,)


@pytest.mark.parametrize(
    "names",
    [["q1", "q2", "q3", "q4", "q5"], ["q2", "q1", "q3", "q4", "q5", "q6"]],
    ids=["missing", "order"],
)
def test_another_arm_is_refused(tmp_path, names):
    path = chain_file(tmp_path / "arm.xml", names)

    with pytest.raises(ValueError, match="expected the hinges"):
        load_arm(path)


def test_missing_file_is_refused():
    with pytest.raises(FileNotFoundError, match=r"nowhere\.xml"):
        load_arm("nowhere.xml")
