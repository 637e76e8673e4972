"""The gripper's transmission and motion profile."""

import numpy as np
import pytest
from specc_runtime.operators.gripper import (
    distance_to_motor,
    gripper_interpolation,
    gripper_interpolation_duration,
    motor_to_distance,
)


def test_published_motor_positions():
    assert distance_to_motor(0.053) == pytest.approx(1176.5, abs=0.1)
    assert distance_to_motor(0.074) == pytest.approx(0.0, abs=1e-6)
    assert distance_to_motor(0.090) == pytest.approx(-1603.2, abs=0.1)


def test_agrees_with_the_published_inverse():
    for d in np.linspace(0.053, 0.09, 50):
        published = 3.531946456e-6 * np.sqrt(2.622172716e18 - 2.8313e19 * d) - 2564.03432
        assert distance_to_motor(float(d)) == pytest.approx(published, abs=0.01)


def test_distance_and_motor_are_inverse():
    for d in np.linspace(0.053, 0.09, 50):
        assert motor_to_distance(distance_to_motor(float(d))) == pytest.approx(d, abs=1e-12)
    for m in np.linspace(-1800.0, 1200.0, 50):
        assert distance_to_motor(motor_to_distance(float(m))) == pytest.approx(m, abs=1e-6)


def test_motor_closes_the_fingers():
    distances = [motor_to_distance(float(m)) for m in np.linspace(-1800.0, 1200.0, 50)]

    assert (np.diff(distances) < 0.0).all()


def test_wider_than_the_transmission_is_refused():
    with pytest.raises(ValueError, match=r"at most 0\.0926"):
        distance_to_motor(0.1)


@pytest.mark.parametrize(("start", "goal"), [(0.09, 0.053), (0.053, 0.09), (0.06, 0.0615)])
def test_profile_keeps_its_speed_and_ends_exactly(start, goal):
    duration = gripper_interpolation_duration(start, goal)
    seconds = np.linspace(0.0, duration, 1001)
    path = np.array([gripper_interpolation(start, goal, float(t)) for t in seconds])
    speed = np.diff(path) / (duration / 1000)

    assert path[0] == start and path[-1] == goal
    assert gripper_interpolation(start, goal, duration + 1.0) == goal
    assert (np.sign(goal - start) * speed >= 0.0).all()
    assert np.abs(speed).max() <= 0.0123334
    assert np.abs(np.diff(speed)).max() <= 0.0123334 / 0.25 * duration / 1000 * 1.01
    assert np.abs(speed[[0, -1]]).max() < 0.01 * 0.0123334


def test_full_stroke_takes_three_seconds_and_a_ramp():
    assert gripper_interpolation_duration(0.09, 0.053) == pytest.approx(3.25)


def test_no_way_to_go():
    assert gripper_interpolation(0.07, 0.07, 0.0) == 0.07
    assert gripper_interpolation_duration(0.07, 0.07) == 0.0
