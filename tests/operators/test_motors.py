"""MJ, JM and the ratio between motors and joints."""

import numpy as np
import pytest
from specc_runtime.operators.motors import (
    joint_to_motor,
    motor_ratio,
    motor_to_joint,
    motor_torque,
)

from tests.operators.irp6_chain import FRONT, LOWER, MOTOR_LOWER, MOTOR_UPPER, UPPER


def test_synchronisation_pose():
    q = motor_to_joint(np.zeros(6))

    assert q == pytest.approx([-0.10443, -1.54765, 0.01231, 1.21064, 4.08203, -2.66439], abs=1e-5)


def test_joints_from_motors_and_back_over_the_whole_range_of_the_motors():
    rng = np.random.default_rng(1)
    for m in rng.uniform(MOTOR_LOWER, MOTOR_UPPER, (2000, 6)):
        assert joint_to_motor(motor_to_joint(m)) == pytest.approx(m, abs=2e-6)


def test_motors_from_joints_and_back_within_the_limits():
    rng = np.random.default_rng(2)
    within = 0
    for q in rng.uniform(LOWER, UPPER, (2000, 6)):
        m = joint_to_motor(q)
        if (m > MOTOR_LOWER).all() and (m < MOTOR_UPPER).all():
            within += 1
            assert motor_to_joint(m) == pytest.approx(q, abs=2e-6)
    assert within > 200


def test_pitches_at_the_motor_limits():
    lowest, highest = motor_to_joint(MOTOR_LOWER), motor_to_joint(MOTOR_UPPER)
    ends = np.array([lowest, highest])
    t2, t3 = ends[:, 1], ends[:, 1] + ends[:, 2] + np.pi / 2
    t4 = t3 + ends[:, 3]

    assert sorted(t2) == pytest.approx([-2.195, -0.913], abs=1e-3)
    assert sorted(t3) == pytest.approx([-0.459, 0.624], abs=1e-3)
    assert sorted(t4) == pytest.approx([-1.723, 1.793], abs=1e-3)


def test_beyond_the_stroke_of_a_screw_is_refused():
    with pytest.raises(ValueError, match="stroke of a ball screw"):
        motor_to_joint(np.array([0.0, 400.0, 0.0, 0.0, 0.0, 0.0]))


def test_ratio_is_the_derivative_of_the_motors_by_the_joints():
    rng = np.random.default_rng(3)
    step = 1e-5
    for q in rng.uniform(LOWER, UPPER, (100, 6)):
        derivative = np.column_stack(
            [
                (joint_to_motor(q + step * e) - joint_to_motor(q - step * e)) / (2 * step)
                for e in np.eye(6)
            ]
        )
        assert motor_ratio(q) == pytest.approx(derivative, abs=1e-5)


def test_ratio_at_the_front_pose():
    ratio = np.abs(motor_ratio(FRONT))

    assert np.diag(ratio) == pytest.approx([158.0, 173.67, 175.13, 128.0, 76.8, 288.88], abs=0.01)


def test_motor_torques_do_the_work_of_the_joint_torques():
    rng = np.random.default_rng(4)
    for q in rng.uniform(LOWER, UPPER, (100, 6)):
        tau = rng.normal(0.0, 50.0, 6)
        assert motor_ratio(q).T @ motor_torque(tau, q) == pytest.approx(tau, abs=1e-9)
