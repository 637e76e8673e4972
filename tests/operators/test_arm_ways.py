"""Straight ways: poses between two, ways that an arm can go or not, bounds of joints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.operators.approach import Motion, at_rest
from specc_runtime.operators.arms.kinematics import direct_kinematics
from specc_runtime.operators.arms.model import Arm, load_arm
from specc_runtime.operators.arms.ways import between, no_way, on_way, straight_way

from tests.operators import seven_joints as panda

BOUNDS = {"v_max": 0.5, "a_max": 2.0, "w_max": 1.0, "alpha_max": 4.0}
FAST = np.full(7, 3.0)
T = 0.01

rotations = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda v: np.linalg.norm(v) > 0.1)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Arm:
    path = tmp_path_factory.mktemp("arm") / "panda.xml"
    path.write_text(panda.model())
    return load_arm(str(path), "base", "flange", 7)


def pose(quaternion: tuple[float, ...], p: tuple[float, ...]) -> np.ndarray:
    """X (4, 4) of a quaternion (w, x, y, z) of any length."""
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    v = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    X = np.eye(4)
    X[:3, :3] += 2 * w * v + 2 * v @ v
    X[:3, 3] = p
    return X


@given(a=rotations, b=rotations, s=st.floats(0.0, 1.0))
def test_a_pose_between_two_divides_the_line_and_the_angle(
    a: tuple[float, ...], b: tuple[float, ...], s: float
) -> None:
    X_0, X_1 = pose(a, (0.0, 0.0, 0.0)), pose(b, (1.0, 2.0, -1.0))
    X = between(X_0, X_1, np.array([s]))
    assert X[:3, 3] == pytest.approx(s * X_1[:3, 3])
    assert X[:3, :3] @ X[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
    assert angle(X_0, X) == pytest.approx(s * angle(X_0, X_1), abs=1e-6)
    assert angle(X, X_1) == pytest.approx((1 - s) * angle(X_0, X_1), abs=1e-6)


def angle(X: np.ndarray, Y: np.ndarray) -> float:
    """By the chord between two rotations, which is exact for small angles, too."""
    return float(2 * np.arcsin(min(1.0, np.linalg.norm(X[:3, :3] - Y[:3, :3]) / np.sqrt(8))))


def test_a_way_has_the_bounds_of_its_line_and_of_its_turn(arm: Arm) -> None:
    X_0 = direct_kinematics(arm, panda.HOME)
    along, turned = X_0.copy(), X_0.copy()
    along[1, 3] += 0.25
    turned[:3, :3] = X_0[:3, :3] @ pose((np.cos(0.2), 0, 0, np.sin(0.2)), (0, 0, 0))[:3, :3]
    for goal, v, a in ((along, 0.5 / 0.25, 2.0 / 0.25), (turned, 1.0 / 0.4, 4.0 / 0.4)):
        way = straight_way(arm, panda.HOME, goal, **BOUNDS, q_v_max=FAST)
        assert way is not None
        assert (way.v[0], way.a[0]) == pytest.approx((v, a))
        assert np.allclose(way.X_0, X_0)
        assert np.array_equal(way.X_1, goal)


def test_slow_joints_make_a_slow_way(arm: Arm) -> None:
    goal = direct_kinematics(arm, panda.HOME)
    goal[1, 3] += 0.25
    slow = straight_way(arm, panda.HOME, goal, **BOUNDS, q_v_max=0.1 * FAST)
    assert slow is not None
    motion, fastest = at_rest(panda.HOME), np.zeros(7)
    for s in np.arange(0.0, 1.0, slow.v[0] * T):
        motion = on_way(arm, slow, np.array([s]), motion, 0.1 * FAST, T)
        assert motion is not None
        fastest = np.maximum(fastest, np.abs(motion.v))
    assert 0.8 < (fastest / (0.1 * FAST)).max() <= 1.0
    assert direct_kinematics(arm, motion.q)[:3, 3] == pytest.approx(goal[:3, 3], abs=2e-3)


def test_there_is_no_way_out_of_reach_or_through_the_ends_of_ranges(arm: Arm) -> None:
    X_0 = direct_kinematics(arm, panda.HOME)
    far, behind = X_0.copy(), X_0.copy()
    far[0, 3] += 1.0
    behind[0, 3] *= -1.0  # through the column
    for goal in (far, behind):
        assert straight_way(arm, panda.HOME, goal, **BOUNDS, q_v_max=FAST) is None


def test_a_joint_that_would_be_too_fast_is_not_on_the_way(arm: Arm) -> None:
    goal = direct_kinematics(arm, panda.HOME)
    goal[1, 3] += 0.25
    way = straight_way(arm, panda.HOME, goal, **BOUNDS, q_v_max=FAST)
    assert way is not None
    start = at_rest(panda.HOME)
    assert on_way(arm, way, np.array([0.5]), start, FAST, T) is None
    moved = on_way(arm, way, np.array([0.01]), start, FAST, T)
    assert isinstance(moved, Motion)
    assert moved.v == pytest.approx((moved.q - panda.HOME) / T)


def test_no_way_stays(arm: Arm) -> None:
    X = direct_kinematics(arm, panda.HOME)
    way = no_way()
    assert np.array_equal(between(way.X_0, way.X_1, np.array([0.3])), np.eye(4))
    here = straight_way(arm, panda.HOME, X, **BOUNDS, q_v_max=FAST)
    assert here is not None and np.isfinite(here.v).all() and np.isfinite(here.a).all()
