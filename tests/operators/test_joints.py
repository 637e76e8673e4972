"""Controllers of joints: each axis for itself, and limits that hold."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.operators.joints import regulated, scaled, within

numbers = st.floats(-1e6, 1e6)
vectors = st.lists(numbers, min_size=1, max_size=7).map(np.array)


@given(vectors, st.data())
def test_each_axis_is_controlled_for_itself(e, data):
    v, K, D = (
        np.array(data.draw(st.lists(numbers, min_size=e.size, max_size=e.size))) for _ in range(3)
    )
    expected = [
        regulated(*(np.array([part[i]]) for part in (e, v, K, D)))[0] for i in range(e.size)
    ]
    assert regulated(e, v, K, D).tolist() == expected


def test_a_regulator_brings_joints_to_rest():
    """Critically damped: without overshoot, to 1 % in 7 periods of its natural frequency."""
    mass, frequency, period = np.array([0.1, 2.0]), 20.0, 0.001
    q, v, goal = np.zeros(2), np.zeros(2), np.array([1.0, -0.5])
    for _ in range(round(7.0 / frequency / period)):
        force = regulated(goal - q, v, frequency**2 * mass, 2 * frequency * mass)
        v = v + force / mass * period
        q = q + v * period
        assert (np.abs(q) <= np.abs(goal)).all()
    np.testing.assert_allclose(q, goal, rtol=0.01)


@given(vectors)
def test_limits_hold_and_change_nothing_inside(u):
    least, greatest = np.full(u.size, -10.0), np.full(u.size, 20.0)
    limited = within(u, least, greatest)
    assert ((limited >= least) & (limited <= greatest)).all()
    inside = (u >= least) & (u <= greatest)
    assert limited[inside].tolist() == u[inside].tolist()


@given(vectors)
def test_each_speed_is_scaled_by_its_own(v):
    by = np.arange(float(v.size))
    assert scaled(v, by).tolist() == [value * i for i, value in enumerate(v.tolist())]
