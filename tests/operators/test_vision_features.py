"""FE and IC: features are found where the picture has something, and come to lie on its surface."""

import numpy as np
import pytest
from specc_runtime.operators.vision.camera import back_project, kinect_intrinsics, project
from specc_runtime.operators.vision.features import extract_features, to_cartesian
from specc_runtime.operators.vision.values import Features

from tests.operators.synthetic_camera import lying_box, random_boxes, render, with_noise

P = kinect_intrinsics()


def features_at(*pixels):
    return Features(np.array(pixels, float), np.zeros((len(pixels), 128), np.float32))


def test_projection_undoes_back_projection():
    rng = np.random.default_rng(1)
    pixels, depth = rng.uniform((0, 0), (640, 480), (200, 2)), rng.uniform(0.5, 3, 200)
    points = back_project(pixels, depth, P)
    np.testing.assert_allclose(points[:, 2], depth)
    np.testing.assert_allclose(project(points, P), pixels, atol=1e-9)


def test_the_middle_of_the_picture_is_on_the_axis():
    np.testing.assert_allclose(back_project(np.array([[319.5, 239.5]]), np.ones(1), P), [[0, 0, 1]])


def test_a_plain_picture_has_no_features():
    assert len(extract_features(np.full((480, 640, 3), 90, np.uint8)).points) == 0


def test_a_blob_is_found_at_its_centre():
    v, u = np.mgrid[0:120, 0:160]
    blob = 60 + 180 * np.exp(-((u - 70.25) ** 2 + (v - 41.75) ** 2) / (2 * 3.0**2))
    found = extract_features(np.repeat(blob[..., None], 3, axis=2).astype(np.uint8)).points
    assert len(found) > 0
    np.testing.assert_allclose(found[0], (70.25, 41.75), atol=0.1)


def test_features_lie_on_the_boxes_and_hardly_on_the_table():
    target = lying_box("mnich", 0, 0.72, -0.25, 0.4)
    rgb, depth = render((target,))
    found = extract_features(rgb)
    assert len(found.points) >= 30
    column, row = np.rint(found.points).astype(int).T
    empty = render(())[1]
    assert np.mean(depth[row, column] < empty[row, column] - 0.01) > 0.8


def test_a_feature_without_depth_is_left_out():
    depth = np.zeros((480, 640), np.float32)
    depth[:, 320:] = 1.0
    cloud = to_cartesian(features_at((100, 100), (500, 100)), depth, P)
    np.testing.assert_allclose(cloud.points, back_project(np.array([[500.0, 100]]), np.ones(1), P))
    assert cloud.descriptors.shape == (1, 128)


def test_directions_point_to_the_camera():
    cloud = to_cartesian(features_at((0, 0), (639, 479)), np.ones((480, 640), np.float32), P)
    np.testing.assert_allclose(np.linalg.norm(cloud.seen_from, axis=1), 1)
    np.testing.assert_allclose(np.cross(cloud.seen_from, cloud.points), 0, atol=1e-12)
    assert (cloud.seen_from[:, 2] < 0).all()


@pytest.mark.parametrize(("column", "expected"), [(318, 1.0), (321, 1.06)])
def test_depth_is_not_averaged_across_a_step(column, expected):
    depth = np.ones((480, 640), np.float32)
    depth[:, 320:] = 1.06
    cloud = to_cartesian(features_at((column, 200)), depth, P)
    assert cloud.points[0, 2] == pytest.approx(expected, abs=1e-6)


def test_averaging_removes_most_of_the_noise_of_the_depth():
    rng = np.random.default_rng(2)
    exact = np.full((480, 640), 1.1, np.float32)
    _, noisy = with_noise(np.zeros((480, 640, 3)), exact, rng)
    pixels = [(u, v) for u in range(10, 630, 20) for v in range(10, 470, 20)]
    z = to_cartesian(features_at(*pixels), noisy, P).points[:, 2]
    assert np.std(noisy) > 1.7e-3
    assert np.std(z - 1.1) < 0.4e-3


def test_no_features_give_an_empty_cloud():
    none = extract_features(np.zeros((480, 640, 3), np.uint8))
    cloud = to_cartesian(none, np.ones((480, 640), np.float32), P)
    assert cloud.points.shape == (0, 3)


def test_extraction_is_repeatable():
    rgb, _ = render(random_boxes(np.random.default_rng(3)))
    one, other = extract_features(rgb), extract_features(rgb)
    np.testing.assert_array_equal(one.points, other.points)
    np.testing.assert_array_equal(one.descriptors, other.descriptors)
