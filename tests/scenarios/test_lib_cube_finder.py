"""The finder of cubes of the library: how a cube is turned, whichever of its sides it lies on."""

from __future__ import annotations

from itertools import permutations, product
from math import pi
from pathlib import Path

import numpy as np
import pytest

from specc.testing import Stepped

SPEC = """\
specc: 1.2
system: table
frames: {F: table}
agents:
  eye:
    real_receptors: {cube: {y: {at: "point[F]", edge: "vector[3]", other_edge: "vector[3]"}}}
    virtual_receptors:
      cube: {use: "specc:cube_finder", rate: 50 Hz, with: {F: F}}
    control:
      rate: 50 Hz
      x: {cube: {at: {type: "point[F]", init: "[0, 0, 0]"}, turn: {type: "real[rad]", init: 0}}}
      memory: {turn: {type: "real[rad]", init: 0}}
      functions: {see: {turn: x.cube.turn}}
      behaviours: {see: {functions: [see], terminal: never}}
      states: {seeing: see}
      initial_state: seeing
"""
SIDES = [
    side
    for order in permutations(np.eye(3))
    for signs in product((1.0, -1.0), repeat=3)
    if np.linalg.det(side := np.array(order) * np.array(signs)[:, None]) > 0.0
]


@pytest.fixture
def finder(tmp_path: Path) -> Stepped:
    (tmp_path / "table.yaml").write_text(SPEC)
    return Stepped(tmp_path / "table.yaml", "eye.cube")


def test_a_cube_is_turned_by_less_than_an_eighth_whichever_side_is_up(finder: Stepped) -> None:
    assert len(SIDES) == 24
    for side, turn in product(SIDES, (0.0, 0.3, -0.7, 0.75)):
        c, s = np.cos(turn), np.sin(turn)
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ side
        at = np.array([0.4, 0.1, 0.02])
        finder.step({"x.R.at": at, "x.R.edge": R[:, 0], "x.R.other_edge": R[:, 1]})
        assert finder["y.c.turn"] == pytest.approx(turn, abs=1e-9)
        assert np.array_equal(finder["y.c.at"], at)


def test_a_quarter_of_a_turn_is_none(finder: Stepped) -> None:
    edges = {"x.R.edge": [0.0, 1.0, 0.0], "x.R.other_edge": [-1.0, 0.0, 0.0]}
    finder.step({"x.R.at": np.zeros(3), **{name: np.array(v) for name, v in edges.items()}})
    assert finder["y.c.turn"] == pytest.approx(0.0)
    assert abs(finder["y.c.turn"]) < pi / 4
