"""Joints that approach goals keep their bounds, arrive, and take no longer than they must."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime.operators.approach import Motion, approach, at_rest

from tests.seeds import how_many

T = 0.01
V = np.array([1.0, 0.3, 2.0])
A = np.array([2.0, 5.0, 0.7])
SLACK = 1e-9
# The longest way, 6.0 at 0.3 a second, takes 20.06 s.
LONGEST = 2100

positions = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3).map(np.array)


def followed(start: Motion, goal: np.ndarray, periods: int) -> list[Motion]:
    motions = [start]
    for _ in range(periods):
        motions.append(approach(motions[-1], goal, V, A, T))
    return motions


def check_bounds(motions: list[Motion]) -> None:
    q, v = (np.array(part) for part in zip(*motions, strict=True))
    assert np.all(np.abs(v) <= V + SLACK)
    assert np.all(np.abs(np.diff(v, axis=0)) <= A * T + SLACK)
    assert np.diff(q, axis=0) / T == pytest.approx(v[1:], abs=1e-6)


@pytest.mark.long
@settings(max_examples=how_many(8), deadline=None)
@given(start=positions, goals=st.lists(positions, min_size=1, max_size=4), after=st.data())
def test_bounds_hold_whatever_the_goals_are_and_whenever_they_change(
    start: np.ndarray, goals: list[np.ndarray], after: st.DataObject
) -> None:
    motions = [at_rest(start)]
    for goal in goals:
        motions += followed(motions[-1], goal, after.draw(st.integers(1, 150)))[1:]
    motions += followed(motions[-1], goals[-1], LONGEST)[1:]
    check_bounds(motions)
    assert np.array_equal(motions[-1].q, goals[-1])
    assert not motions[-1].v.any()


@settings(max_examples=how_many(8), deadline=None)
@given(start=positions, goal=positions)
def test_from_rest_no_joint_passes_its_goal_or_takes_two_periods_too_long(
    start: np.ndarray, goal: np.ndarray
) -> None:
    motions = followed(at_rest(start), goal, LONGEST)
    way = np.abs(goal - start)
    gone = np.array([motion.q for motion in motions]) - start
    assert np.all(np.abs(gone) <= way + SLACK)
    shortest = np.where(way < V * V / A, 2.0 * np.sqrt(way / A), way / V + V / A)
    left = np.abs(gone) < way - SLACK
    assert np.all(left.sum(axis=0) * T <= shortest + 2.0 * T)


def test_without_velocity_it_brakes() -> None:
    moving = Motion(np.zeros(3), np.array([1.0, -0.3, 2.0]))
    motions = [moving]
    for _ in range(300):
        motions.append(approach(motions[-1], motions[-1].q, 0.0 * V, A, T))
    check_bounds(motions)
    assert not motions[-1].v.any()
    assert motions[-1].q[0] == pytest.approx(0.25, abs=0.02)
