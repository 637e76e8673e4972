"""The language's functions against their definitions."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.builtins import (
    argmax,
    argmin,
    identity,
    inverse,
    near,
    near_pose,
    norm,
    pose,
    position,
    read_only,
    rotation,
    rpy,
    some,
    translation,
    vector,
)

coordinates = st.floats(-3.0, 3.0)
axes = st.tuples(coordinates, coordinates, coordinates).filter(lambda v: math.hypot(*v) > 1e-3)


def _pose(axis: tuple[float, ...], angle: float, origin: tuple[float, ...]) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = np.array(axis) / math.hypot(*axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    X = np.eye(4)
    X[:3, :3] += math.sin(angle) * K + (1 - math.cos(angle)) * K @ K
    X[:3, 3] = origin
    return X


poses = st.builds(_pose, axes, st.floats(-3.1, 3.1), st.tuples(*[coordinates] * 3))


@given(poses)
def test_inverse_undoes(X: np.ndarray) -> None:
    np.testing.assert_allclose(inverse(X) @ X, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(inverse(inverse(X)), X, atol=1e-12)


@given(poses, axes, st.floats(1e-6, 3.1), st.floats(0.5, 2.0).filter(lambda f: abs(f - 1) > 1e-3))
def test_near_pose_measures_the_angle_between(
    X: np.ndarray, axis: tuple[float, ...], angle: float, factor: float
) -> None:
    Y = X @ _pose(axis, angle, (0.0, 0.0, 0.0))
    assert near_pose(X, Y, 1e-9, angle * factor) == (factor > 1 or angle * factor > math.pi)
    assert near_pose(Y, X, 1e-9, angle * factor) == near_pose(X, Y, 1e-9, angle * factor)


@given(poses, st.tuples(coordinates, coordinates, coordinates))
def test_near_pose_measures_the_distance_between(X: np.ndarray, p: tuple[float, ...]) -> None:
    Y = X @ translation(*p)
    assert near_pose(X, Y, math.hypot(*p) + 1e-9, 1e-6)
    if math.hypot(*p) > 1e-6:
        assert not near_pose(X, Y, math.hypot(*p) * 0.999, 1e-6)


def test_near_takes_the_largest_component() -> None:
    a, b = np.array([1.0, 2.0]), np.array([1.1, 2.3])
    assert near(a, b, 0.31)
    assert not near(a, b, 0.29)
    assert near(1.0, 1.5, 0.5)
    assert not near(1.0, 1.5, 0.49)


@pytest.mark.parametrize("tolerance", [1.0, math.inf])
def test_nothing_is_near_what_is_not_used(tolerance: float) -> None:
    assert not near(math.nan, 0.0, tolerance)
    assert not near(np.array([0.0, math.nan]), np.zeros(2), tolerance)
    X = np.eye(4)
    X[0, 3] = math.nan
    assert not near_pose(X, np.eye(4), tolerance, tolerance)


@given(axes, st.floats(-3.1, 3.1), st.floats(0.1, 10.0))
def test_pose_from_a_quaternion_of_any_length(
    axis: tuple[float, ...], angle: float, length: float
) -> None:
    unit = np.array(axis) / math.hypot(*axis)
    quaternion = length * np.append(math.sin(angle / 2) * unit, math.cos(angle / 2))
    expected = _pose(axis, angle, (1.0, 2.0, 3.0))
    np.testing.assert_allclose(pose(np.array([1.0, 2.0, 3.0]), quaternion), expected, atol=1e-12)


@pytest.mark.parametrize("quaternion", [np.zeros(4), np.full(4, math.nan), np.full(4, math.inf)])
def test_a_quaternion_without_direction_is_refused(quaternion: np.ndarray) -> None:
    with pytest.raises(ValueError, match="no direction"):
        pose(np.zeros(3), quaternion)


angles = st.floats(-7.0, 7.0)


@given(axes, angles, st.sampled_from((1e-290, 1.0, 1e200, 1e307)))
def test_a_rotation_about_an_axis_of_any_length(
    axis: tuple[float, ...], angle: float, length: float
) -> None:
    X = rotation(length * np.array(axis), angle)
    np.testing.assert_allclose(X, _pose(axis, angle, (0.0, 0.0, 0.0)), atol=1e-12)
    assert not X.flags.writeable


@given(axes, angles, angles)
def test_rotations_about_one_axis_add_their_angles(
    axis: tuple[float, ...], one: float, other: float
) -> None:
    a = np.array(axis)
    np.testing.assert_allclose(
        rotation(a, one) @ rotation(a, other), rotation(a, one + other), atol=1e-12
    )
    np.testing.assert_allclose(rotation(a, -one), inverse(rotation(a, one)), atol=1e-12)
    np.testing.assert_allclose(rotation(-a, one), rotation(a, -one), atol=1e-12)
    np.testing.assert_array_equal(rotation(a, 0.0), np.eye(4))
    np.testing.assert_allclose(
        rotation(a, one)[:3, :3], pin.AngleAxis(one, a / norm(a)).matrix(), atol=1e-12
    )


@given(angles, angles, angles)
def test_roll_pitch_and_yaw_are_three_rotations(roll: float, pitch: float, yaw: float) -> None:
    x, y, z = np.eye(3)
    product = rotation(z, yaw) @ rotation(y, pitch) @ rotation(x, roll)
    np.testing.assert_allclose(rpy(roll, pitch, yaw), product, atol=1e-12)
    np.testing.assert_allclose(
        rpy(roll, pitch, yaw)[:3, :3], pin.rpy.rpyToMatrix(roll, pitch, yaw), atol=1e-12
    )
    assert not rpy(roll, pitch, yaw).flags.writeable


def test_no_angle_is_the_identity() -> None:
    np.testing.assert_array_equal(rpy(0.0, 0.0, 0.0), np.eye(4))
    np.testing.assert_allclose(rpy(0.0, math.pi / 2, 0.0)[:3, 0], (0.0, 0.0, -1.0), atol=1e-15)


@pytest.mark.parametrize("axis", [np.zeros(3), np.full(3, math.nan), np.full(3, math.inf)])
def test_an_axis_without_direction_is_refused(axis: np.ndarray) -> None:
    with pytest.raises(ValueError, match="no direction"):
        rotation(axis, 1.0)


def test_parts_of_poses() -> None:
    X = translation(1.0, 2.0, 3.0)
    assert position(X).tolist() == [1.0, 2.0, 3.0]
    assert not np.shares_memory(position(X), X)
    assert norm(position(X)) == math.sqrt(14.0)
    np.testing.assert_array_equal(identity(), np.eye(4))
    with pytest.raises(ValueError, match="read-only"):
        identity()[0, 0] = 2.0


@given(st.lists(st.floats(allow_nan=True), max_size=6))
def test_a_vector_holds_its_components_and_cannot_change(components: list[float]) -> None:
    v = vector(*components)
    assert v.dtype == np.float64
    assert np.array_equal(v, np.array(components, dtype=float), equal_nan=True)
    assert not v.flags.writeable


def test_what_was_made_read_only_is_the_same_array() -> None:
    X = translation(1.0, 2.0, 3.0)
    assert read_only(X) is X
    with pytest.raises(ValueError, match="read-only"):
        X[0, 3] = 0.0


def test_nothing_is_near_within_a_negative_tolerance() -> None:
    X = identity()
    assert near_pose(X, X, 0.0, 0.0)
    assert not near_pose(X, X, -0.1, 0.1)
    assert not near_pose(X, X, 0.1, -0.1)
    assert not near(1.0, 1.0, -0.1)


@pytest.mark.parametrize(
    ("numbers", "largest", "smallest"),
    [
        ((1.0,), 0, 0),
        ((1.0, 3.0, 2.0, 3.0, 1.0), 1, 0),
        ((math.nan, 1.0, math.nan, 0.0), 1, 3),
        ((math.nan, math.nan), 0, 0),
        ((math.nan, -math.inf), 1, 1),
        ((0.0, -0.0), 0, 0),
        ((2, 5, 10**30), 2, 0),
    ],
)
def test_the_best_item_is_the_first_of_several_and_never_one_without_a_number(
    numbers: tuple[float, ...], largest: int, smallest: int
) -> None:
    assert argmax((number, index) for index, number in enumerate(numbers)) == largest
    assert argmin((number, index) for index, number in enumerate(numbers)) == smallest


def test_there_is_no_best_of_nothing() -> None:
    for best in (argmax, argmin):
        with pytest.raises(ValueError, match="empty"):
            best(())


def test_some_gives_what_is_there_and_refuses_what_is_not() -> None:
    assert some(0.0) == 0.0
    with pytest.raises(ValueError, match="None"):
        some(None)
