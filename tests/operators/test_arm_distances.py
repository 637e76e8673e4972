"""Distances of an arm: against those of balls to capsules, which are computed by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.operators.arms.distances import clearance, distance
from specc_runtime.operators.arms.model import Arm, load_arm

from tests.operators import seven_joints as panda

BALL = np.array([0.6, 0.3, 0.9])
BALL_M, LINK_M, HALF_M = 0.1, 0.04, 0.05
WORLD = f"""\
<geom name="ball" size="{BALL_M}" pos="{" ".join(map(str, BALL))}" contype="1" conaffinity="0"/>
<body name="picture"><geom name="picture" size="2" contype="0" conaffinity="0"/></body>
<body name="loose" pos="0.2 -0.1 1"><freejoint/>
  <geom name="loose" size="0.05" contype="1" conaffinity="0"/></body>
<body name="bare"/>
"""

shares = st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7).map(np.array)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Arm:
    path = tmp_path_factory.mktemp("arm") / "panda.xml"
    path.write_text(panda.model(more=WORLD, free=True))
    return load_arm(str(path), "base", "flange", 7)


def links(q: np.ndarray) -> list[np.ndarray]:
    """The ends (2, 3) of the axis of each capsule in the world."""
    turn = 2 * np.arctan2(0.6, 0.8)
    X_WB = np.array(
        [
            [np.cos(turn), -np.sin(turn), 0, 0.2],
            [np.sin(turn), np.cos(turn), 0, -0.1],
            [0, 0, 1, 0.5],
            [0, 0, 0, 1],
        ]
    )
    found = (X_WB @ X for X in panda.links(q))
    return [X[:3, 3] + np.outer((-HALF_M, HALF_M), X[:3, 2]) for X in found]


def to_ball(ends: np.ndarray) -> float:
    along = ends[1] - ends[0]
    share = np.clip((BALL - ends[0]) @ along / (along @ along), 0.0, 1.0)
    return float(np.linalg.norm(ends[0] + share * along - BALL)) - LINK_M - BALL_M


@given(share=shares)
def test_distances_are_those_of_the_shapes(arm: Arm, share: np.ndarray) -> None:
    q = panda.LOWER + share * (panda.UPPER - panda.LOWER)
    expected = [to_ball(ends) for ends in links(q)]
    found = [distance(arm, q, f"link{k}", "ball", 5.0) for k in range(1, 8)]
    assert found == pytest.approx(expected, abs=1e-6)
    finger = distance(arm, q, "finger", "ball", 5.0)
    assert clearance(arm, q, 5.0) == pytest.approx(min(*expected, finger), abs=1e-6)
    assert clearance(arm, q, 0.01) == pytest.approx(min(*expected, finger, 0.01), abs=1e-6)


def test_bodies_are_as_far_as_the_nearest_of_their_geoms_that_collide(arm: Arm) -> None:
    q = panda.HOME
    by_body = distance(arm, q, "loose", "finger", 5.0)
    assert by_body == distance(arm, q, "finger", "loose", 5.0)
    with pytest.raises(ValueError, match="body 'bare' has no geoms that collide"):
        distance(arm, q, "bare", "finger", 1.0)
    with pytest.raises(ValueError, match="neither a geom nor a body 'cup'"):
        distance(arm, q, "cup", "finger", 1.0)


def test_links_that_collide_with_each_other_are_kept_apart_unless_they_are_neighbours(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    path = tmp_path_factory.mktemp("arm") / "panda.xml"
    path.write_text(panda.model().replace('contype="0"', 'contype="1"', 1))
    arm = load_arm(str(path), "base", "flange", 7)
    apart = min(
        distance(arm, panda.HOME, f"link{a}", f"link{b}", 5.0)
        for a in range(1, 8)
        for b in range(a + 2, 8)
    )
    near = [distance(arm, panda.HOME, f"link{k}", "finger", 5.0) for k in range(1, 7)]
    assert clearance(arm, panda.HOME, 5.0) == pytest.approx(min(apart, *near))
    folded = panda.HOME.copy()
    folded[3] = panda.LOWER[3]
    assert clearance(arm, folded, 5.0) < clearance(arm, panda.HOME, 5.0)


def test_pairs_that_the_model_excludes_are_left_out(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    path = tmp_path_factory.mktemp("arm") / "panda.xml"
    text = panda.model().replace('contype="0"', 'contype="1"', 1)
    bodies = [*(f"link{k}" for k in range(1, 8)), "finger"]
    pairs = [f'<exclude body1="{a}" body2="{b}"/>' for a in bodies for b in bodies if a > b]
    path.write_text(text.replace("</mujoco>", f"<contact>{''.join(pairs)}</contact></mujoco>"))
    arm = load_arm(str(path), "base", "flange", 7)
    assert distance(arm, panda.HOME, "link5", "link7", 5.0) < 0.0
    assert clearance(arm, panda.HOME, 5.0) == 5.0


def test_of_overlaps_the_deepest_counts(tmp_path: Path) -> None:
    path = tmp_path / "press.xml"
    path.write_text("""\
<mujoco>
  <worldbody>
    <geom name="shallow" size="0.1" pos="0 0 0"/>
    <geom name="deep" size="0.1" pos="0 0 0.02"/>
    <body name="ram"><joint type="slide" axis="0 0 1"/>
      <geom name="ram" type="box" size="0.1 0.1 0.1"/></body>
  </worldbody>
</mujoco>
""")
    arm = load_arm(str(path), "world", "ram", 1)
    q = np.array([0.02])
    deep = distance(arm, q, "deep", "ram", 1.0)
    assert deep == pytest.approx(-0.2)
    assert clearance(arm, q, 1.0) == deep
