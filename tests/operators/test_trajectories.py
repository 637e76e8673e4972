"""Trajectories keep their bounds of velocity, acceleration and jerk, and end at rest."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime.examination import same
from specc_runtime.operators.arms.ways import between
from specc_runtime.operators.trajectories import (
    State,
    Trajectory,
    decode_trajectory,
    encode_trajectory,
    planned,
    remaining,
    resting,
    sampled,
    stopping,
)

from tests.seeds import how_many

V, A, J = np.array([1.0, 0.3, 2.0]), np.array([2.0, 5.0, 0.7]), np.array([10.0, 50.0, 7.0])
T = 0.005

positions = st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=3).map(np.array)
shares = st.floats(0.0, 1.2)


def followed(trajectory: Trajectory, until_s: float) -> list[State]:
    return [sampled(trajectory, k * T) for k in range(int(until_s / T) + 1)]


def check_bounds(states: list[State]) -> None:
    q, v, a = (np.array(part) for part in zip(*states, strict=True))
    assert np.all(np.abs(v) <= V * (1 + 1e-9))
    assert np.all(np.abs(a) <= A * (1 + 1e-9))
    assert np.all(np.abs(np.diff(a, axis=0)) <= J * T * (1 + 1e-6))
    assert np.all(np.abs(np.diff(v, axis=0)) <= A * T * (1 + 1e-6))
    assert np.all(np.abs(np.diff(q, axis=0)) <= V * T * (1 + 1e-6))


@settings(max_examples=how_many(20), deadline=None)
@given(start=positions, goals=st.lists(st.tuples(positions, shares), min_size=1, max_size=4))
def test_bounds_hold_whatever_the_goals_are_and_whenever_they_change(
    start: np.ndarray, goals: list[tuple[np.ndarray, float]]
) -> None:
    state, states = resting(start), [resting(start)]
    for goal, share in goals:
        way = planned(state, goal, V, A, J)
        seen = followed(way, share * way.duration_s)
        assert np.allclose(seen[0].q, state.q) and np.allclose(seen[0].a, state.a)
        states, state = states + seen[1:], seen[-1]
    check_bounds(states)
    end = sampled(way, way.duration_s)
    assert np.array_equal(end.q, goals[-1][0])
    assert not end.v.any() and not end.a.any()


@settings(max_examples=how_many(20), deadline=None)
@given(start=positions, goal=positions, share=shares)
def test_stopping_ends_at_rest_as_soon_as_its_slowest_axis_can(
    start: np.ndarray, goal: np.ndarray, share: float
) -> None:
    way = planned(resting(start), goal, V, A, J)
    state = sampled(way, share * way.duration_s)
    stop = stopping(state, A, J)
    check_bounds(followed(stop, stop.duration_s + T))
    # Ending acceleration first, then braking with the largest jerk and acceleration.
    assert stop.duration_s <= np.max(np.abs(state.v) / A + 4.0 * A / J) + 1e-6
    assert remaining(stop, stop.duration_s + 1.0) == 0.0


def test_all_axes_arrive_together() -> None:
    way = planned(resting(np.zeros(3)), np.array([0.1, 1.0, 0.2]), V, A, J)
    before = sampled(way, way.duration_s - 0.02)
    assert np.all(np.abs(before.v) > 1e-6)


def test_the_share_of_a_straight_way_is_an_axis_like_any_other() -> None:
    X_0, X_1 = np.eye(4), np.eye(4)
    X_1[:3, 3] = (0.3, 0.4, 0.0)  # half a metre: 0.25 m/s, 1 m/s2, 10 m/s3
    way = planned(
        resting(np.zeros(1)), np.ones(1), np.full(1, 0.5), np.full(1, 2.0), np.full(1, 20.0)
    )
    p = [between(X_0, X_1, s.q)[:3, 3] for s in followed(way, way.duration_s + T)]
    v = np.diff(p, axis=0) / T
    a = np.diff(v, axis=0) / T
    assert np.linalg.norm(v, axis=1).max() == pytest.approx(0.25)
    assert np.linalg.norm(a, axis=1).max() <= 1.0 + 1e-6
    assert np.linalg.norm(np.diff(a, axis=0), axis=1).max() / T <= 10.0 + 1e-3
    assert p[-1] == pytest.approx(X_1[:3, 3])


@pytest.mark.parametrize("stops", [False, True])
def test_a_trajectory_comes_back_from_its_bytes(stops: bool) -> None:
    start = State(np.array([0.1, 0.2, 0.3]), 0.5 * V, -0.2 * A)
    way = stopping(start, A, J) if stops else planned(start, np.ones(3), V, A, J)
    again = decode_trajectory(encode_trajectory(way))
    for elapsed_s in (0.0, 0.3, 10.0):
        assert same(sampled(again, elapsed_s), sampled(way, elapsed_s))
    with pytest.raises(ValueError, match="reshape"):
        decode_trajectory(bytes(8 * 8))


def test_a_start_that_exceeds_a_bound_comes_back_within_it_and_arrives() -> None:
    start = State(np.zeros(3), 3.0 * V, np.zeros(3))
    way = planned(start, np.ones(3), V, A, J)
    v = np.array([state.v for state in followed(way, way.duration_s + T)])
    back = np.argmax(np.all(np.abs(v) <= V * (1 + 1e-9), axis=1))
    assert 0 < back < len(v) - 1
    assert np.all(np.abs(v[back:]) <= V * (1 + 1e-9))
    assert np.array_equal(sampled(way, way.duration_s).q, np.ones(3))


def test_numbers_without_a_trajectory_are_told() -> None:
    with pytest.raises(ValueError, match="there is no trajectory"):
        planned(resting(np.zeros(3)), np.full(3, np.inf), V, A, J)


def test_bounds_have_to_be_positive() -> None:
    with pytest.raises(ValueError, match="have to be positive"):
        planned(resting(np.zeros(3)), np.ones(3), V, A, 0.0 * J)


def test_a_process_that_leaves_its_objects_to_the_system_ends_without_warnings() -> None:
    code = f"""\
import gc, sys
sys.path[:0] = {sys.path!r}
from specc_runtime.operators.trajectories import ruckig
round = [ruckig.Trajectory(1)]
round.append(round)
gc.freeze()
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout + done.stderr == ""
