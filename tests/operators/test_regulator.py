"""The motor regulators on the published drives, with currents one period late."""

import numpy as np
import pytest
from specc_runtime.operators.gripper import (
    gripper_interpolation,
    gripper_regulator,
    initial_gripper_regulator_state,
)
from specc_runtime.operators.motors import initial_regulator_state, motor_regulator

PERIOD = 0.002
KT = 0.105
INERTIA = np.array([1.5e-4, 1.5e-4, 1.5e-4, 1.5e-4, 1.5e-4, 1.5e-5])
DAMPING = np.array([0.02, 0.02, 0.02, 0.02, 0.02, 2e-4])
LARGEST = np.array([20.0, 15.0, 18.0, 15.0, 8.0, 1.0])
COUNTS = np.array([4000.0, 4000.0, 4000.0, 4000.0, 4000.0, 2000.0])
# A, BB0, BB1, kp in mA, eps
GAINS = (
    (0.412429378531, 1.5569592, 1.5028614, 200, 0.01),
    (0.655629139073, 0.6181068, 0.5916852, 100, 0.008),
    (0.315789473684, 1.1984784, 1.1424828, 120, 0.008),
    (0.548946716233, 0.6305064, 0.5874396, 170, 0.01),
    (0.391982182628, 0.4458592, 0.4085392, 110, 0.02),
    (0.3, 0.5456, 0.5056, 11, 0.005),
)


def quintic(seconds, duration, distance):
    x = np.clip(seconds / duration, 0.0, 1.0)
    return distance * x**3 * (10 - 15 * x + 6 * x * x)


class Drives:
    """J dw/dt = kt i - B w + load, with the current that was set one period ago."""

    def __init__(self, inertia=INERTIA, load=0.0):
        self.position = np.zeros(6)
        self.speed = np.zeros(6)
        self.inertia = inertia
        self.load = load
        self.late = np.zeros(6)

    def step(self, current):
        torque = KT * self.late - DAMPING * self.speed + self.load
        self.speed = self.speed + torque / self.inertia * PERIOD
        self.position = self.position + self.speed * PERIOD
        self.late = current


@pytest.mark.parametrize("times_inertia", [1.0, 2.0])
def test_follows_a_motion_of_40_rad_closely_and_arrives(times_inertia):
    drives, state = Drives(times_inertia * INERTIA), initial_regulator_state()
    errors = []
    for i in range(3000):
        error = quintic(i * PERIOD, 2.0, 40.0) - drives.position
        output = motor_regulator(error, state, np.zeros(6))
        state = output.state
        drives.step(output.c_d)
        errors.append(np.abs(error))

    assert np.max(errors, axis=0).max() <= 0.3
    assert np.max(errors[-200:], axis=0) == pytest.approx(0.0, abs=1e-3)


def test_an_offset_at_the_start_is_removed():
    drives, state = Drives(), initial_regulator_state()
    for _ in range(3000):
        output = motor_regulator(1.0 - drives.position, state, np.zeros(6))
        state = output.state
        drives.step(output.c_d)

    assert drives.position == pytest.approx(1.0, abs=1e-3)


def test_feedforward_that_balances_the_load_leaves_nothing_to_regulate():
    load = np.array([0.0, 0.5, -0.4, 0.1, 0.02, 0.001])
    drives, state = Drives(load=load), initial_regulator_state()
    drives.late = -load / KT
    for _ in range(500):
        output = motor_regulator(-drives.position, state, -load / KT)
        state = output.state
        drives.step(output.c_d)

    assert np.abs(drives.position).max() < 1e-12


def test_no_error_gives_no_current():
    output = motor_regulator(np.zeros(6), initial_regulator_state(), np.zeros(6))

    assert (output.c_d == 0.0).all()


def test_each_axis_obeys_the_published_law_of_increments():
    rng = np.random.default_rng(1)
    errors = np.cumsum(rng.normal(0.0, 1e-3, (300, 6)), axis=0)
    state, currents = initial_regulator_state(), []
    for error in errors:
        output = motor_regulator(error, state, np.zeros(6))
        state = output.state
        currents.append(output.c_d)

    for axis, (a, b0, b1, kp, eps) in enumerate(GAINS):
        counts = errors[:, axis] * COUNTS[axis] / (2 * np.pi)
        delta = delta_1 = e_1 = u_1 = u_2 = 0.0
        for k, e in enumerate(np.diff(counts, prepend=0.0)):
            delta = delta_1 + (1 + eps) * e - (1 - eps) * e_1
            u = (1 + a) * u_1 - a * u_2 + b0 * delta - b1 * delta_1
            assert currents[k][axis] == pytest.approx(kp * u / 1000, abs=1e-9)
            delta_1, e_1, u_2, u_1 = delta, e, u_1, u


def test_currents_stay_within_the_limits_feedforward_included():
    rng = np.random.default_rng(2)
    state = initial_regulator_state()
    reached = np.zeros(6, dtype=bool)
    for _ in range(200):
        output = motor_regulator(rng.normal(0, 5, 6), state, rng.normal(0, 5, 6))
        state = output.state
        assert (np.abs(output.c_d) <= LARGEST).all()
        reached |= np.abs(output.c_d) == LARGEST
    assert reached.all()


def test_a_blocked_motion_does_not_wind_the_regulator_up():
    state = initial_regulator_state()
    for _ in range(2500):  # five seconds against a stop
        output = motor_regulator(np.full(6, 1.0), state, np.zeros(6))
        state = output.state
    assert output.c_d == pytest.approx(LARGEST)

    for _ in range(500):  # one second wanted back by as much
        output = motor_regulator(np.full(6, -1.0), state, np.zeros(6))
        state = output.state
    assert (output.c_d < 0.0).all()


def test_calls_do_not_share_state():
    error = np.full(6, 0.01)
    first = motor_regulator(error, initial_regulator_state(), np.zeros(6))
    motor_regulator(error, first.state, np.zeros(6))
    again = motor_regulator(error, initial_regulator_state(), np.zeros(6))

    assert (again.c_d == first.c_d).all()
    assert again.state == first.state


# The gripper: the free-running current of 40 mA is dry friction.

FRICTION = 0.040 * KT
RAD_PER_M = 1 / 1.451910074e-5


def run_gripper(wanted, stop=np.inf):
    """Motor positions and currents while the motor follows wanted rad and meets a stop."""
    position = speed = late = 0.0
    state = initial_gripper_regulator_state()
    positions, currents = [], []
    for goal in wanted:
        output = gripper_regulator(goal - position, state)
        state = output.state
        for _ in range(20):  # friction needs finer steps than the regulator
            torque = KT * late - 2e-6 * speed
            friction = np.clip(torque + speed * 5e-7 / 1e-4, -FRICTION, FRICTION)
            speed += (torque - friction) / 5e-7 * 1e-4
            position += speed * 1e-4
            if position > stop:
                position, speed = stop, 0.0
        late = output.c_d
        positions.append(position)
        currents.append(output.c_d)
    return np.array(positions), np.array(currents)


def test_gripper_follows_its_interpolation_with_less_current_than_a_grasp():
    seconds = np.arange(2500) * PERIOD
    wanted = [RAD_PER_M * (0.09 - gripper_interpolation(0.09, 0.06, float(t))) for t in seconds]

    positions, currents = run_gripper(wanted)

    assert np.abs(positions - wanted).max() < 0.001 * RAD_PER_M
    assert positions[-1] == pytest.approx(wanted[-1], abs=1e-4 * RAD_PER_M)
    assert np.abs(currents).max() < 0.095


def test_gripper_presses_with_its_largest_current_and_lets_go_at_once():
    seconds = np.arange(2500) * PERIOD
    close = [RAD_PER_M * (0.09 - gripper_interpolation(0.09, 0.073, float(t))) for t in seconds]
    open_again = [
        RAD_PER_M * (0.09 - gripper_interpolation(0.073, 0.09, float(t))) for t in seconds
    ]

    positions, currents = run_gripper([*close, *open_again], stop=RAD_PER_M * 0.015)

    assert currents[2499] == pytest.approx(0.120)
    holding = np.flatnonzero(positions[2500:] > RAD_PER_M * 0.0149)
    assert holding.max() * PERIOD < 0.6
