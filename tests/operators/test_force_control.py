"""GE, PF and AA: their laws in the frame of the end-effector."""

import numpy as np
import pytest
from specc_runtime.operators.force_control import (
    angle_axis_to_pose,
    eliminate_gravity,
    position_force,
)

from tests.operators.irp6_chain import shift, tool_down, turn

NAN = float("nan")
WEIGHT = 13.18
X_WRIST_S = shift(0.0, 0.0, 0.09) @ turn("z", -np.pi / 2)  # published quaternion (0, 0, -.7, .7)
X_ES = np.linalg.inv(shift(0.0, 0.0, 0.25)) @ X_WRIST_S
COM = (np.linalg.inv(X_WRIST_S) @ [0.004, 0.0, 0.13, 1.0])[:3]


def hat(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def rotation(vector):
    """Exponential of a rotation vector by its power series."""
    result, term = np.eye(3), np.eye(3)
    for k in range(1, 60):
        term = term @ hat(vector) / k
        result = result + term
    return result


def random_poses(count, seed):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        pose = shift(*rng.uniform(-1, 1, 3))
        pose[:3, :3] = rotation(rng.normal(0, 2, 3))
        yield pose


def moved(wrench, X_AB):
    """A wrench given in B, at its origin, expressed in A, at A's origin."""
    force = X_AB[:3, :3] @ wrench[:3]
    return np.concatenate([force, X_AB[:3, :3] @ wrench[3:] + np.cross(X_AB[:3, 3], force)])


def weight_in_sensor(X_BE):
    down_in_S = (X_BE @ X_ES)[:3, :3].T @ [0.0, 0.0, -WEIGHT]
    return np.concatenate([down_in_S, np.cross(COM, down_in_S)])


def test_hand_in_free_air_exerts_nothing_in_any_orientation():
    for X_BE in random_poses(200, seed=1):
        F_c = eliminate_gravity(weight_in_sensor(X_BE), X_BE, WEIGHT, COM)
        assert F_c == pytest.approx(np.zeros(6), abs=1e-12)


def test_wrench_of_the_environment_is_turned_into_that_of_the_robot():
    rng = np.random.default_rng(2)
    for X_BE in random_poses(200, seed=3):
        on_hand_at_E = rng.normal(0, 10, 6)
        F_m = weight_in_sensor(X_BE) + moved(on_hand_at_E, np.linalg.inv(X_ES))
        assert eliminate_gravity(F_m, X_BE, WEIGHT, COM) == pytest.approx(-on_hand_at_E, abs=1e-10)


def test_pressing_down_on_a_table_is_a_positive_force_along_the_tool():
    X_BE = tool_down(0.7, -0.2, 0.95, yaw=0.4)
    table_in_E = np.array([0.0, 0.0, -5.0, 0.0, 0.0, 0.0])  # up, against the tool axis
    F_m = weight_in_sensor(X_BE) + moved(table_in_E, np.linalg.inv(X_ES))

    F_c = eliminate_gravity(F_m, X_BE, WEIGHT, COM)

    assert F_c == pytest.approx([0, 0, 5.0, 0, 0, 0], abs=1e-12)


def pf(mode, F_d=NAN, V_d=NAN, D_d=NAN, I_d=NAN, rdot_p=0.0, F_c=0.0):
    """The velocity of one component, the same parameters for all six."""
    full = [np.full(6, value) for value in (F_d, V_d, D_d, I_d)]
    rdot_d = position_force(*full, (mode,) * 6, np.full(6, rdot_p), np.full(6, F_c), 0.002)
    assert (rdot_d == rdot_d[0]).all()
    return rdot_d[0]


def test_unguarded_motion_is_the_desired_velocity_whatever_the_rest():
    assert pf("u", V_d=0.3, rdot_p=7.0, F_c=50.0) == 0.3
    assert pf("u", V_d=0.3, F_c=NAN, rdot_p=NAN) == 0.3
    assert pf("u", F_d=9.0, V_d=0.3, D_d=1.0, I_d=5.0, F_c=50.0) == 0.3


def test_stop_rests_whatever_the_rest():
    assert pf("s", rdot_p=7.0, F_c=50.0) == 0.0
    assert pf("s", F_d=1.0, V_d=1.0, D_d=1.0, I_d=1.0, rdot_p=NAN, F_c=NAN) == 0.0


def test_contact_ignores_the_velocity_and_yields_to_the_force_error():
    assert pf("c", F_d=3.0, D_d=200.0, I_d=0.0, F_c=1.0) == pytest.approx(0.01)
    assert pf("c", F_d=3.0, V_d=5.0, D_d=200.0, I_d=0.0, F_c=3.0) == 0.0


def test_guarded_motion_ignores_the_desired_force():
    assert pf("g", V_d=0.01, D_d=200.0, I_d=0.0) == pytest.approx(0.01)
    assert pf("g", F_d=100.0, V_d=0.01, D_d=200.0, I_d=0.0, F_c=2.0) == pytest.approx(0.0)


@pytest.mark.parametrize("mode", ["c", "g"])
def test_inertia_delays_by_equation_26(mode):
    F_d, V_d, D, inertia, previous, F_c, dt = 2.0, 0.01, 250.0, 20.0, 0.004, 1.5, 0.002
    force, velocity = (F_d, 0.0) if mode == "c" else (0.0, V_d)
    expected = (((force - F_c) / D + velocity) * dt + inertia / D * previous) / (dt + inertia / D)

    assert pf(mode, F_d, V_d, D, inertia, previous, F_c) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("damping", [200.0, 400.0])
@pytest.mark.parametrize("stiffness", [5e3, 2e4])
def test_guarded_motion_presses_with_velocity_times_damping(damping, stiffness):
    nothing = np.full(6, NAN)
    velocity = np.array([NAN, NAN, 0.01, NAN, NAN, NAN])
    modes = ("s", "s", "g", "s", "s", "s")
    rdot, depth, forces = np.zeros(6), -0.005, []
    for _ in range(2000):
        F_c = np.array([0, 0, stiffness * max(0.0, depth), 0, 0, 0])
        rdot = position_force(
            nothing, velocity, np.full(6, damping), np.full(6, 20.0), modes, rdot, F_c, 0.002
        )
        depth += rdot[2] * 0.002
        forces.append(F_c[2])

    assert forces[-1] == pytest.approx(0.01 * damping, rel=1e-3)
    assert max(forces) < 10.0
    assert (rdot[[0, 1, 3, 4, 5]] == 0.0).all()


def test_components_have_modes_of_their_own():
    rdot = position_force(
        np.array([NAN, 4.0, NAN, NAN, 0.2, NAN]),
        np.array([0.1, NAN, 0.2, NAN, NAN, 0.3]),
        np.array([NAN, 100.0, 50.0, NAN, 10.0, NAN]),
        np.array([NAN, 0.0, 0.0, NAN, 0.0, NAN]),
        ("u", "c", "g", "s", "c", "u"),
        np.zeros(6),
        np.array([9.0, 1.0, 5.0, 9.0, 0.1, 9.0]),
        0.002,
    )

    assert rdot == pytest.approx([0.1, 0.03, 0.1, 0.0, 0.01, 0.3])


@pytest.mark.parametrize(
    ("mode", "parameters", "complaint"),
    [
        ("u", {"F_d": 1.0, "D_d": 1.0, "I_d": 1.0}, "x: mode u needs a velocity"),
        ("c", {"F_d": 1.0, "V_d": 1.0, "I_d": 1.0}, "damping > 0"),
        ("g", {"V_d": 1.0, "D_d": 1.0}, "inertia >= 0"),
        ("g", {"V_d": 1.0, "D_d": 0.0, "I_d": 1.0}, "damping > 0"),
        ("g", {"V_d": 1.0, "D_d": 1.0, "I_d": -1.0}, "inertia >= 0"),
        ("c", {"D_d": 1.0, "I_d": 1.0}, "numbers"),
        ("x", {"V_d": 1.0}, "unknown mode 'x'"),
    ],
)
def test_missing_parameters_are_refused(mode, parameters, complaint):
    with pytest.raises(ValueError, match=complaint):
        pf(mode, **parameters)


def test_angle_axis_is_the_exponential_of_the_rotation_vector():
    rng = np.random.default_rng(4)
    for angle in (0.0, 1e-9, 1e-5, 0.99e-4, 1.01e-4, 1e-3, 0.3, 1.5, 3.14, 6.0):
        axis = rng.normal(0, 1, 3)
        vector = angle * axis / np.linalg.norm(axis)
        translation = rng.normal(0, 1, 3)

        pose = angle_axis_to_pose(np.concatenate([translation, vector]))

        assert pose[:3, :3] == pytest.approx(rotation(vector), abs=1e-14)
        assert (pose[:3, 3] == translation).all()
        assert (pose[3] == [0, 0, 0, 1]).all()
