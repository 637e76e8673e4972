"""DK and IK of any arm: against published kinematics, and DK(IK(X)) = X."""

from __future__ import annotations

import copy
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime.examination import same
from specc_runtime.operators.arms.kinematics import (
    direct_kinematics,
    inverse_kinematics,
    inverse_kinematics_of_axis,
    inverse_kinematics_of_point,
    jacobian,
    nearby_kinematics,
)
from specc_runtime.operators.arms.model import Arm, load_arm

from tests.operators import seven_joints as panda
from tests.seeds import how_many

N = 7
ENDLESS = """\
<mujoco>
  <compiler angle="radian"/>
  <worldbody>
    <body name="cart"><freejoint/><geom size="0.1"/><site name="mount" pos="0 0 0.1"/>
      <body><joint name="turn" axis="0 0 1"/><geom size="0.1"/>
        <body><joint name="lift" type="slide" axis="0 0 1" range="0 0.5"/><geom size="0.1"/>
          <body pos="0.3 0 0"><joint name="roll" axis="1 0 0"/><geom size="0.1"/>
            <body name="hand"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

shares = st.lists(st.floats(0.0, 1.0), min_size=N, max_size=N).map(np.array)


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("arm") / "panda.xml"
    path.write_text(panda.model())
    return path


@pytest.fixture(scope="module")
def arm(file: Path) -> Arm:
    return load_arm(str(file), "base", "flange", N)


def joints(share: np.ndarray) -> np.ndarray:
    return panda.LOWER + share * (panda.UPPER - panda.LOWER)


def check(arm: Arm, X: np.ndarray, q: np.ndarray) -> None:
    assert np.all((arm.lower <= q) & (q <= arm.upper))
    assert direct_kinematics(arm, q) == pytest.approx(X, abs=2e-6)


@given(share=shares)
def test_direct_kinematics_is_that_of_the_manufacturer(arm: Arm, share: np.ndarray) -> None:
    q = joints(share)
    assert direct_kinematics(arm, q) == pytest.approx(panda.direct(q), abs=1e-12)


def test_inverse_kinematics_finds_random_poses_within_reach(arm: Arm) -> None:
    for share, seed in np.random.default_rng(3).uniform(size=(100, 2, N)):
        X = direct_kinematics(arm, joints(share))
        q = inverse_kinematics(arm, X, joints(seed))
        assert q is not None
        check(arm, X, q)


@settings(max_examples=how_many(30), deadline=None)
@given(share=shares, seed=shares)
def test_what_inverse_kinematics_finds_is_there_and_always_the_same(
    arm: Arm, share: np.ndarray, seed: np.ndarray
) -> None:
    X, q_p = direct_kinematics(arm, joints(share)), joints(seed)
    q = inverse_kinematics(arm, X, q_p)
    if q is not None:  # at ends of ranges and in singular postures it may be missed
        check(arm, X, q)
    again = inverse_kinematics(arm, X.copy(), q_p.copy())
    assert same(q, again)
    assert q is None or not np.shares_memory(q, again)


@settings(max_examples=how_many(30), deadline=None)
@given(share=shares, way=st.lists(st.floats(-0.02, 0.02), min_size=N, max_size=N).map(np.array))
def test_a_pose_nearby_is_reached_without_a_jump(
    arm: Arm, share: np.ndarray, way: np.ndarray
) -> None:
    q_p = joints(0.05 + 0.9 * share)
    X = direct_kinematics(arm, np.clip(q_p + way, arm.lower, arm.upper))
    q = nearby_kinematics(arm, X, q_p)
    if q is not None:  # near singular postures a short way may need long ones of joints
        check(arm, X, q)
    if np.linalg.svd(jacobian(arm, q_p), compute_uv=False)[-1] > 0.1:
        assert q is not None
        assert np.abs(q - q_p).max() < 0.3


def test_the_jacobian_is_the_derivative_of_the_pose(arm: Arm) -> None:
    q, step = panda.HOME, 1e-6
    J = jacobian(arm, q)
    R = direct_kinematics(arm, q)[:3, :3]
    for k, one in enumerate(np.eye(N)):
        after, before = (direct_kinematics(arm, q + s * step * one) for s in (1, -1))
        slope = (after - before) / (2 * step)
        turn = slope[:3, :3] @ R.T
        assert slope[:3, 3] == pytest.approx(J[:3, k], abs=1e-8)
        assert [turn[2, 1], turn[0, 2], turn[1, 0]] == pytest.approx(J[3:, k], abs=1e-8)


def test_an_arm_with_five_joints_gets_its_axis_there_and_one_with_four_its_point(
    file: Path,
) -> None:
    five = load_arm(str(file), "link2", "flange", 5)
    four = load_arm(str(file), "base", "link4", 4)
    rng = np.random.default_rng(5)
    for _ in range(30):
        a, b = rng.uniform(five.lower, five.upper, (2, 5))
        X = direct_kinematics(five, a)
        X[:3, :3] = X[:3, :3] @ turned(rng.uniform(-3.0, 3.0))
        q = inverse_kinematics_of_axis(five, X, b)
        assert q is not None
        reached = direct_kinematics(five, q)
        assert reached[:3, 2:] == pytest.approx(X[:3, 2:], abs=3e-6)
        p = direct_kinematics(four, rng.uniform(four.lower, four.upper))[:3, 3]
        q = inverse_kinematics_of_point(four, p, four.start[four.positions])
        assert q is not None
        assert direct_kinematics(four, q)[:3, 3] == pytest.approx(p, abs=2e-6)


def turned(angle: float) -> np.ndarray:
    """A rotation (3, 3) about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def test_an_axis_turns_round_to_the_opposite(arm: Arm) -> None:
    X = direct_kinematics(arm, panda.HOME)
    X[:3, :3] = X[:3, :3] @ np.diag((1.0, -1.0, -1.0))
    X[:3, 3] = (0.4, 0.0, 0.6)
    q = inverse_kinematics_of_axis(arm, X, panda.HOME)
    assert q is not None
    assert direct_kinematics(arm, q)[:3, 2:] == pytest.approx(X[:3, 2:], abs=3e-6)


def test_a_pose_out_of_reach_has_no_joint_positions(arm: Arm) -> None:
    X = direct_kinematics(arm, panda.HOME)
    X[:3, 3] = (1.0, 0.0, 0.3)
    assert inverse_kinematics(arm, X, panda.HOME) is None
    assert nearby_kinematics(arm, X, panda.HOME) is None


def test_a_seed_beyond_the_ranges_is_as_good_as_their_ends(arm: Arm) -> None:
    X = direct_kinematics(arm, panda.HOME)
    q = inverse_kinematics(arm, X, panda.UPPER + 0.1)
    assert q is not None
    check(arm, X, q)


def test_joints_that_turn_without_end_stay_at_their_turn(tmp_path: Path) -> None:
    path = tmp_path / "cart.xml"
    path.write_text(ENDLESS)
    arm = load_arm(str(path), "mount", "hand", 3)
    X = direct_kinematics(arm, np.array([1.0, 0.3, 2.0]))
    assert X[:3, 3] == pytest.approx([0.3 * np.cos(1.0), 0.3 * np.sin(1.0), 0.2])
    q = inverse_kinematics(arm, X, np.array([1.0 + 2 * np.pi, 0.0, 2.0 - 4 * np.pi]))
    assert q == pytest.approx([1.0 + 2 * np.pi, 0.3, 2.0 - 4 * np.pi], abs=1e-5)
    with pytest.raises(ValueError, match="neither a hinge nor a slide"):
        load_arm(str(path), "world", "hand", 4)


def test_threads_do_not_disturb_each_other(arm: Arm) -> None:
    q = [joints(share) for share in np.random.default_rng(1).uniform(size=(200, N))]
    expected = [direct_kinematics(arm, each).tobytes() for each in q]
    with ThreadPoolExecutor(4) as pool:
        found = [*pool.map(lambda each: direct_kinematics(arm, each).tobytes(), q)]
    assert found == expected


def test_an_arm_is_its_own_copy(arm: Arm) -> None:
    assert copy.deepcopy(arm) is arm


def test_an_arm_takes_as_many_positions_as_it_has_joints(arm: Arm) -> None:
    with pytest.raises(ValueError, match="6 joint positions for an arm with 7 joints"):
        direct_kinematics(arm, np.zeros(6))


@pytest.mark.parametrize(
    ("base", "tip", "n", "told"),
    [
        ("base", "flange", 6, "expected 6 joints between 'base' and 'flange', found 7: q1, q2"),
        ("base", "finger", 7, "found 8: q1, q2, q3, q4, q5, q6, q7, finger"),
        ("base", "tool", 7, "neither a site nor a body 'tool'"),
        ("base", "flang", 7, "nor a body 'flang'; did you mean flange?"),
        ("flange", "base", 7, "has to hang from its base"),
        ("link7", "flange", 0, "no joints between 'link7' and 'flange'"),
    ],
)
def test_what_is_no_arm_is_told(file: Path, base: str, tip: str, n: int, told: str) -> None:
    with pytest.raises(ValueError, match=re.escape(told)):
        load_arm(str(file), base, tip, n)


def test_what_is_no_model_is_told(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match=r"nowhere\.xml"):
        load_arm("nowhere.xml", "base", "flange", N)
    path = tmp_path / "broken.xml"
    path.write_text("<mujoco><worldbody><body></worldbody></mujoco>")
    with pytest.raises(ValueError, match=r"broken\.xml"):
        load_arm(str(path), "base", "flange", N)
