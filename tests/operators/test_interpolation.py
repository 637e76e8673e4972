"""MI: the profile obeys the limits, ends exactly and is one for all axes."""

import numpy as np
import pytest
from specc_runtime.operators.interpolation import interpolation_duration, motor_interpolation
from specc_runtime.operators.kinematics import inverse_kinematics
from specc_runtime.operators.motors import joint_to_motor

from tests.operators.irp6_chain import FRONT, MOTOR_LOWER, MOTOR_UPPER, tool_down

PERIOD = 0.002
# The regulator trips on 200 counts of 4000 (N: of 2000) in one period; 200 rad/s is the ceiling.
SPEED = np.minimum(200.0, 200 / np.array([4000.0] * 5 + [2000.0]) * 2 * np.pi / PERIOD)
ACCELERATION = 150.0


def random_moves(count, seed):
    rng = np.random.default_rng(seed)
    for size in rng.uniform(1e-4, 1.0, count):
        start = rng.uniform(MOTOR_LOWER, MOTOR_UPPER)
        yield start, start + size * (rng.uniform(MOTOR_LOWER, MOTOR_UPPER) - start)


def sampled(start, goal, period=PERIOD):
    steps = int(np.ceil(interpolation_duration(start, goal) / period)) + 1
    return np.array([motor_interpolation(start, goal, i * period) for i in range(steps + 1)])


def test_speed_and_acceleration_stay_within_the_limits_of_the_motors():
    for start, goal in random_moves(20, seed=1):
        path = sampled(start, goal)
        speed = np.diff(path, axis=0) / PERIOD
        acceleration = np.diff(speed, axis=0) / PERIOD
        assert (np.abs(speed) <= SPEED).all()
        assert (np.abs(acceleration) <= ACCELERATION).all()


def test_friction_at_the_largest_speed_leaves_current_for_gravity():
    largest = np.array([20.0, 15.0, 18.0, 15.0, 8.0, 1.0])
    damping = np.array([0.02, 0.02, 0.02, 0.02, 0.02, 2e-4])
    gravity = np.array([0.0, 4.9, 4.9, 0.7, 0.01, 0.0])  # above the table
    for start, goal in random_moves(20, seed=2):
        speed = np.abs(np.diff(sampled(start, goal), axis=0)).max(axis=0) / PERIOD
        assert (damping * speed / 0.105 + gravity < 0.9 * largest).all()


def test_starts_and_ends_exactly_and_rests_there():
    for start, goal in random_moves(20, seed=3):
        duration = interpolation_duration(start, goal)
        assert (motor_interpolation(start, goal, 0.0) == start).all()
        assert (motor_interpolation(start, goal, -1.0) == start).all()
        assert (motor_interpolation(start, goal, duration) == goal).all()
        assert (motor_interpolation(start, goal, duration + 100.0) == goal).all()
        path = sampled(start, goal, duration / 1000)
        assert np.abs(path[1] - path[0]).max() < 1e-6 * np.abs(goal - start).max()
        assert np.abs(path[999] - goal).max() < 1e-6 * np.abs(goal - start).max()


def test_axes_are_monotone_and_move_in_step():
    for start, goal in random_moves(8, seed=4):
        path = sampled(start, goal)
        progress = (path - start) / (goal - start)
        assert (np.diff(progress, axis=0) >= -1e-12).all()
        assert progress == pytest.approx(progress[:, :1] @ np.ones((1, 6)), abs=1e-9)


def test_no_way_to_go_takes_one_period():
    m = joint_to_motor(FRONT)

    assert interpolation_duration(m, m) == PERIOD
    assert (motor_interpolation(m, m, 0.001) == m).all()


def test_a_typical_move_to_above_the_table_takes_some_two_seconds():
    goal = inverse_kinematics(tool_down(0.72, -0.25, 1.2, yaw=-np.pi), FRONT)

    assert 1.5 < interpolation_duration(joint_to_motor(FRONT), joint_to_motor(goal)) < 3.0


def test_arguments_are_left_alone_and_results_are_new():
    start, goal = np.zeros(6), np.ones(6)

    motor_interpolation(start, goal, 100.0)[:] = 7.0
    motor_interpolation(start, goal, 0.0)[:] = 7.0

    assert (start == 0.0).all() and (goal == 1.0).all()
