"""DK and IK: published numbers, the URDF as an oracle, inverse of each other, refusals."""

import numpy as np
import pytest
from specc_runtime.operators.kinematics import (
    UnreachablePose,
    direct_kinematics,
    inverse_kinematics,
    reachable,
)
from specc_runtime.operators.motors import joint_to_motor

from tests.operators.irp6_chain import (
    FRONT,
    LOWER,
    MOTOR_LOWER,
    MOTOR_UPPER,
    UPPER,
    end_effector,
    tool_down,
)


def joints_within_limits(count, seed):
    """Random joint positions inside the limits of joints and motors."""
    rng = np.random.default_rng(seed)
    while count:
        q = rng.uniform(LOWER, UPPER)
        m = joint_to_motor(q)
        if (m > MOTOR_LOWER).all() and (m < MOTOR_UPPER).all():
            count -= 1
            yield q


def test_published_pair_of_joints_and_pose():
    q_arm, q_wrist = (7.692e-06, -1.666887782823, -0.125264630877), (0.221354291444, 4.712395088435)
    q = np.array([*q_arm, *q_wrist, -1.570794906485])
    half_turn_about_y = np.diag([-1.0, 1.0, -1.0])  # quaternion (0, 1, 0, 0)

    X_BE = direct_kinematics(q)

    assert X_BE[:3, 3] == pytest.approx([0.8, 0.0, 1.3], abs=1e-4)
    assert X_BE[:3, :3] == pytest.approx(half_turn_about_y, abs=1e-4)


def test_published_initial_pose_for_grasping():
    X_BE = direct_kinematics(FRONT)

    assert X_BE[:3, 3] == pytest.approx([0.86, 0.0, 1.155], abs=1e-9)
    assert X_BE[:3, 2] == pytest.approx([0.0, 0.0, -1.0], abs=1e-9)


def test_direct_kinematics_agrees_with_the_chain_of_the_urdf():
    rng = np.random.default_rng(1)
    for q in rng.uniform(LOWER, UPPER, (500, 6)):
        assert direct_kinematics(q) == pytest.approx(end_effector(q), abs=1e-12)


def test_inverse_kinematics_finds_the_joints_from_a_previous_position_nearby():
    rng = np.random.default_rng(2)
    for q in joints_within_limits(1000, seed=3):
        if abs(np.sin(q[4])) < 0.03:
            continue
        q_p = q + rng.uniform(-0.02, 0.02, 6)
        assert inverse_kinematics(direct_kinematics(q), q_p) == pytest.approx(q, abs=1e-9)


def test_inverse_kinematics_gives_the_pose_from_any_previous_position():
    previous = list(joints_within_limits(300, seed=4))
    found = 0
    for q, q_p in zip(joints_within_limits(300, seed=5), previous, strict=True):
        X_BE = direct_kinematics(q)
        if not reachable(X_BE, q_p):
            continue
        found += 1
        assert end_effector(inverse_kinematics(X_BE, q_p)) == pytest.approx(X_BE, abs=1e-9)
    assert found > 100


def test_branch_of_the_wrist_follows_the_previous_position():
    X_BE = direct_kinematics(FRONT)
    for turns in (-1, 0):
        q_p = FRONT + np.array([0, 0, 0, 0, 2 * np.pi * turns, 0])
        assert abs(q_p[4]) < 10.0
        if turns:
            with pytest.raises(UnreachablePose, match="motor 5"):
                inverse_kinematics(X_BE, q_p)
        else:
            assert inverse_kinematics(X_BE, q_p) == pytest.approx(q_p, abs=1e-12)


@pytest.mark.parametrize("q5", [0.0, np.pi, 2 * np.pi])
def test_singular_wrist_keeps_the_pitch_of_the_previous_position(q5):
    q = np.array([0.3, -1.5, 0.1, 0.2, q5, 0.7])
    q_p = q + np.array([0.01, -0.01, 0.02, 0.005, 1e-3, -0.01])

    found = inverse_kinematics(direct_kinematics(q), q_p)

    assert end_effector(found) == pytest.approx(end_effector(q), abs=1e-9)
    assert found[1:4].sum() == pytest.approx(q_p[1:4].sum(), abs=1e-12)
    assert found == pytest.approx(q_p, abs=0.1)


def test_almost_singular_wrist_still_gives_the_pose():
    for offset in 10.0 ** np.arange(-13.0, -2.0):
        q = np.array([0.3, -1.5, 0.1, 0.2, np.pi + offset, 0.7])
        found = inverse_kinematics(direct_kinematics(q), q)
        assert end_effector(found) == pytest.approx(end_effector(q), abs=1e-9)


@pytest.mark.parametrize("place", [(2.0, 0.0, 1.0), (0.3, 0.0, 1.2), (0.0, 0.0, 3.0)])
def test_out_of_reach_is_refused_with_the_pose(place):
    X_BE = tool_down(*place, yaw=0.0)

    with pytest.raises(UnreachablePose, match=f"{place[0]:.4f}") as refusal:
        inverse_kinematics(X_BE, FRONT)

    assert refusal.value.X_BE is X_BE
    assert not reachable(X_BE, FRONT)


def test_pose_beyond_a_joint_limit_is_refused_by_name():
    q = FRONT + np.array([0.0, 0.0, 0.75, -0.75, 0.0, 0.0])
    X_BE = direct_kinematics(q)

    with pytest.raises(UnreachablePose, match=r"joint 3 at 0\.75"):
        inverse_kinematics(X_BE, q)


def test_turn_of_n_is_undone_in_a_far_target_only():
    q = np.array([0.0, -1.5708, 0.0, 0.0, 4.7124, -2.8])
    other_end = direct_kinematics(q)

    far = inverse_kinematics(other_end, q + np.array([0, 0, 0, 0, 0, 5.0]))
    assert far == pytest.approx(q, abs=1e-9)

    beyond = direct_kinematics(q + np.array([0, 0, 0, 0, 0, -0.1]))
    with pytest.raises(UnreachablePose, match="joint 6"):
        inverse_kinematics(beyond, q + np.array([0, 0, 0, 0, 0, -0.08]))


def test_arguments_are_left_alone():
    q, q_p = FRONT.copy(), FRONT + 0.01
    X_BE = direct_kinematics(q)
    before = X_BE.copy()

    inverse_kinematics(X_BE, q_p)

    assert (before == X_BE).all() and (q == FRONT).all() and (q_p == FRONT + 0.01).all()
