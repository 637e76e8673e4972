"""The textured region: it holds the objects and their features, and not plain things with edges."""

import numpy as np
import pytest
from specc_runtime.operators.vision import opencv
from specc_runtime.operators.vision.features import extract_features
from specc_runtime.operators.vision.region import MARGIN_PX, textured_region

from tests.operators.synthetic_camera import lying_box, random_boxes, render, with_noise
from tests.seeds import short


def checkered(rng, height, width):
    return np.kron(rng.integers(0, 2, (height // 4, width // 4)) * 200, np.ones((4, 4))).astype(
        np.uint8
    )


def test_the_region_is_around_the_texture():
    picture = np.full((480, 640), 128, np.uint8)
    picture[160:256, 320:400] = checkered(np.random.default_rng(1), 96, 80)
    rows, columns = textured_region(picture)
    assert 160 - MARGIN_PX - 16 <= rows.start <= 160 - MARGIN_PX
    assert 256 + MARGIN_PX <= rows.stop <= 256 + MARGIN_PX + 16
    assert 320 - MARGIN_PX - 16 <= columns.start <= 320 - MARGIN_PX
    assert 400 + MARGIN_PX <= columns.stop <= 400 + MARGIN_PX + 16


def test_the_region_ends_with_the_picture():
    picture = checkered(np.random.default_rng(2), 484, 636)
    rows, columns = textured_region(picture)
    assert (rows, columns) == (slice(0, 484), slice(0, 636))


def test_plain_things_and_their_edges_are_not_texture():
    picture = np.full((480, 640), 40, np.uint8)
    picture[100:300, 50:60] = 220
    v, u = np.mgrid[0:480, 0:640]
    picture[np.abs(u - v) < 20] = 180
    picture[(u - 450) ** 2 + (v - 300) ** 2 < 80**2] = 120
    rows, columns = textured_region(picture)
    assert picture[rows, columns].size == 0


def test_noise_is_not_texture():
    rng = np.random.default_rng(3)
    rgb, _ = with_noise(*render(()), rng)
    rows, _ = textured_region(opencv.to_gray(rgb))
    assert (rows.start, rows.stop) == (0, 0)


@pytest.mark.parametrize("seed", short(range(30, 34), 0))
def test_no_feature_of_an_object_is_lost(seed):
    rng = np.random.default_rng(seed)
    boxes = random_boxes(rng)
    rgb, depth = render(boxes)
    whole, _ = opencv.sift(opencv.to_gray(rgb))
    found = extract_features(rgb).points
    apart = np.linalg.norm(whole[:, None] - found[None], axis=2).min(axis=1)
    column, row = np.rint(whole).astype(int).T
    on_box = depth[row, column] < render(())[1][row, column] - 0.01
    assert on_box.sum() > 80
    assert np.mean(apart[on_box] < 0.3) > 0.97


def test_a_single_box_seen_end_on_is_in_the_region():
    for side in (4, 5):
        rgb, depth = render((lying_box("sen", side, 0.7, -0.2, 0.6),))
        rows, columns = textured_region(opencv.to_gray(rgb))
        row, column = np.nonzero(depth < render(())[1] - 0.01)
        assert rows.start <= row.min() <= row.max() < rows.stop
        assert columns.start <= column.min() <= column.max() < columns.stop
