"""LR and GC: grasps that fit the gripper, the box and the arm."""

import numpy as np
import pytest
from specc_runtime.operators.grasping import (
    LONGEST_SIDE_M,
    SQUEEZE_M,
    NotGraspable,
    grasp_pose,
    graspable,
    left_right_grasp,
)
from specc_runtime.operators.irp6 import FINGERS_LOWER, FINGERS_UPPER, JOINT_LOWER, JOINT_UPPER
from specc_runtime.operators.kinematics import direct_kinematics, inverse_kinematics
from specc_runtime.operators.vision.values import Cloud, FeatureCloud, Object

from tests.operators.synthetic_camera import NAMES, TABLE_Z, lying_box

NOTHING = np.empty((0, 3))
AT_TIPS = np.eye(4)
X_PG = AT_TIPS.copy()
X_PG[2, 3] = 0.2
Q_BEFORE = np.array([0.0, -np.pi / 2, 0.0, 0.0, 1.5 * np.pi, -np.pi / 2])


def finger_distance(fingers):
    return np.linalg.norm(fingers.X_Bl[:3, 3] - fingers.X_Br[:3, 3])


def recognised(X_BO, size, label="box_0"):
    cloud = Cloud(NOTHING, NOTHING.astype(np.uint8))
    features = FeatureCloud(NOTHING, NOTHING, np.empty((0, 128), np.float32))
    return Object(cloud, features, X_BO, 0.03, label, np.array(size))


def tilted(angle, axis):
    """The box "sen" on the table, turned about a horizontal axis through its centre."""
    box = lying_box("sen", 0, 0.75, -0.25, 0.3)
    c, s = np.cos(angle), np.sin(angle)
    turn = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}
    box.X_BO[:3, :3] = np.array(turn[axis]) @ box.X_BO[:3, :3]
    return recognised(box.X_BO, box.size)


def lying_boxes(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        radius, bearing = rng.uniform(0.68, 0.95), rng.uniform(-0.9, 0.2)
        x, y = radius * np.cos(bearing), radius * np.sin(bearing)
        name = NAMES[rng.integers(3)]
        box = lying_box(name, int(rng.integers(6)), x, y, rng.uniform(-np.pi, np.pi))
        yield recognised(box.X_BO, box.size, f"{name}_0")


def test_boxes_on_the_table_are_taken_from_above_across_a_side_that_fits():
    for target in lying_boxes(60, seed=1):
        is_taken_from_above_across_a_side_that_fits(target)


def is_taken_from_above_across_a_side_that_fits(target):
    fingers = left_right_grasp(target)
    X_BE = grasp_pose(fingers, np.eye(4))
    height = np.abs(target.X[2, :3]) @ target.size
    np.testing.assert_allclose(X_BE[:3, 2], (0, 0, -1), atol=1e-12)
    np.testing.assert_allclose(X_BE[:3, :3].T @ X_BE[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(X_BE[:3, :3]) == pytest.approx(1)
    np.testing.assert_allclose(X_BE[:2, 3], target.X[:2, 3], atol=1e-9)
    assert TABLE_Z + 0.02 < X_BE[2, 3] <= TABLE_Z + height - 0.025
    across = np.abs(target.X[:3, :3].T @ X_BE[:3, 1])
    assert across.max() == pytest.approx(1)
    side = target.size[across.argmax()]
    assert finger_distance(fingers) == pytest.approx(side - SQUEEZE_M)
    assert FINGERS_LOWER <= finger_distance(fingers) < side < FINGERS_UPPER


def test_the_arm_reaches_every_grasp_with_its_last_joint_near_the_middle():
    for target in lying_boxes(60, seed=2):
        is_reached_with_the_last_joint_near_the_middle(target)


def is_reached_with_the_last_joint_near_the_middle(target):
    assert graspable(target, AT_TIPS, X_PG, Q_BEFORE)
    X_BE = grasp_pose(left_right_grasp(target), np.eye(4))
    q = inverse_kinematics(X_BE, Q_BEFORE)
    assert (np.array(JOINT_LOWER) <= q).all()
    assert (q <= JOINT_UPPER).all()
    assert abs(q[5]) < np.pi / 2 + 0.05
    np.testing.assert_allclose(direct_kinematics(q), X_BE, atol=1e-6)


def test_left_and_right_are_the_ends_of_the_axis_that_the_fingers_move_along():
    fingers = left_right_grasp(next(iter(lying_boxes(1, seed=3))))
    X_BE = grasp_pose(fingers, np.eye(4))
    along = fingers.X_Bl[:3, 3] - fingers.X_Br[:3, 3]
    np.testing.assert_allclose(along / np.linalg.norm(along), X_BE[:3, 1], atol=1e-12)
    np.testing.assert_array_equal(fingers.X_Bl[:3, :3], fingers.X_Br[:3, :3])


def test_the_shorter_of_two_sides_that_fit_is_taken():
    X_BO = np.eye(4)
    X_BO[:3, 3] = (0.75, -0.25, TABLE_Z + 0.05)
    assert finger_distance(left_right_grasp(recognised(X_BO, (0.07, 0.06, 0.1)))) == pytest.approx(
        0.06 - SQUEEZE_M
    )
    assert finger_distance(left_right_grasp(recognised(X_BO, (0.06, 0.07, 0.1)))) == pytest.approx(
        0.06 - SQUEEZE_M
    )


def test_of_a_flat_box_the_fingers_stay_above_the_lower_half():
    X_BO = np.eye(4)
    X_BO[:3, 3] = (0.75, -0.25, TABLE_Z + 0.015)
    X_BE = grasp_pose(left_right_grasp(recognised(X_BO, (0.14, 0.06, 0.03))), np.eye(4))
    assert X_BE[2, 3] == pytest.approx(TABLE_Z + 0.015)


def test_turning_a_box_by_half_a_turn_changes_nothing():
    for target in lying_boxes(20, seed=4):
        X_BO = target.X.copy()
        X_BO[:3, :3] = np.diag((-1.0, -1.0, 1.0)) @ X_BO[:3, :3]
        other = recognised(X_BO, target.size)
        one, two = (grasp_pose(left_right_grasp(each), np.eye(4)) for each in (target, other))
        np.testing.assert_allclose(one, two, atol=1e-12)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_small_tilt_is_taken_for_an_error_of_the_pose(axis):
    X_BE = grasp_pose(left_right_grasp(tilted(0.1, axis)), np.eye(4))
    np.testing.assert_allclose(X_BE[:3, 2], (0, 0, -1), atol=1e-12)


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("angle", [0.3, -0.5])
def test_a_leaning_box_is_approached_along_the_normal_of_its_face(axis, angle):
    target = tilted(angle, axis)
    X_BE = grasp_pose(left_right_grasp(target), np.eye(4))
    np.testing.assert_allclose(X_BE[:3, 2], -target.X[:3, 2] * np.sign(target.X[2, 2]), atol=1e-9)
    assert abs(target.X[:3, 1] @ X_BE[:3, 1]) == pytest.approx(1)


def test_the_constant_offset_of_the_gripper_is_taken_off():
    target = next(iter(lying_boxes(1, seed=5)))
    fingers = left_right_grasp(target)
    X_EF = np.eye(4)
    X_EF[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    X_EF[:3, 3] = (0.01, 0, 0.03)
    X_BF = grasp_pose(fingers, X_EF) @ X_EF
    np.testing.assert_allclose(X_BF, grasp_pose(fingers, np.eye(4)), atol=1e-12)


@pytest.mark.parametrize("size", [(0.14, 0.12, 0.06), (0.05, 0.04, 0.06), (0.14, 0.0885, 0.06)])
def test_a_box_without_a_side_that_fits_is_refused(size):
    X_BO = np.eye(4)
    X_BO[:3, 3] = (0.75, -0.25, TABLE_Z + 0.03)
    target = recognised(X_BO, size, "trunk_2")
    with pytest.raises(NotGraspable, match=r"trunk_2.*no side"):
        left_right_grasp(target)
    assert not graspable(target, AT_TIPS, X_PG, Q_BEFORE)
    assert LONGEST_SIDE_M < FINGERS_UPPER


def test_a_box_on_its_edge_is_refused():
    target = tilted(np.pi / 4, "x")
    with pytest.raises(NotGraspable, match="level"):
        left_right_grasp(target)
    assert not graspable(target, AT_TIPS, X_PG, Q_BEFORE)


@pytest.mark.parametrize(("x", "y"), [(1.5, 0.0), (0.3, -0.1)])
def test_a_box_out_of_reach_is_not_graspable(x, y):
    box = lying_box("mnich", 0, x, y, 0.0)
    assert not graspable(recognised(box.X_BO, box.size), AT_TIPS, X_PG, Q_BEFORE)


def test_the_pregrasp_pose_and_the_gripper_count_for_reach():
    target = next(iter(lying_boxes(1, seed=6)))
    far, long = AT_TIPS.copy(), AT_TIPS.copy()
    far[2, 3], long[2, 3] = 1.5, 1.0
    assert graspable(target, AT_TIPS, X_PG, Q_BEFORE)
    assert not graspable(target, AT_TIPS, far, Q_BEFORE)
    assert not graspable(target, long, X_PG, Q_BEFORE)
