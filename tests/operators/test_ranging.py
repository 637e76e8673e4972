"""Echoes lie where beams ended, and turn with the robot."""

from __future__ import annotations

import numpy as np
import pytest
from specc_runtime.operators.ranging import echoes

QUARTERS = np.pi / 2 * np.arange(4)
RING = np.radians([0.0, 20.0, 45.0, 90.0, 180.0, -90.0, -45.0, -20.0])
AT = np.array([1.0, 2.0, 0.1])


def test_echoes_are_where_the_beams_ended() -> None:
    found = echoes(AT, 0.0, np.array([0.9, 3.0, 1.9, 0.4]), QUARTERS, 0.1, 3.0)
    assert np.allclose(found, AT + np.array([[1.0, 0, 0], [-2.0, 0, 0], [0, -0.5, 0]]))


def test_what_met_nothing_has_no_echo() -> None:
    assert echoes(AT, 0.0, np.full(8, 3.0), RING, 0.1, 3.0) == ()


@pytest.mark.parametrize("turn", np.linspace(0.0, 6.0, 7))
def test_a_ring_that_is_turned_sees_the_same_as_beams_that_are(turn: float) -> None:
    d = np.arange(1.0, 9.0)
    there = echoes(AT, 0.3 + turn, d, RING, 0.1, 10.0)
    assert np.allclose(there, echoes(AT, 0.3, d, RING + turn, 0.1, 10.0))
