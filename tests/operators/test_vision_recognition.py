"""The whole of eq. 51 on pictures of random scenes, against the poses they were made with."""

from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest
from specc_runtime.operators.vision import matching
from specc_runtime.operators.vision.camera import kinect_intrinsics
from specc_runtime.operators.vision.features import extract_features, to_cartesian
from specc_runtime.operators.vision.grouping import group_correspondences
from specc_runtime.operators.vision.hypotheses import project_hypotheses
from specc_runtime.operators.vision.matching import match_features
from specc_runtime.operators.vision.values import model_label_of
from specc_runtime.operators.vision.verification import verify_hypotheses

from tests.operators.synthetic_camera import (
    MODELS,
    X_BK,
    lying_box,
    pose_error,
    random_boxes,
    render,
    with_noise,
)

P = kinect_intrinsics()
SCENES = 4, pytest.param(24, marks=pytest.mark.long)


def recognise(rgb, depth):
    C_scene = to_cartesian(extract_features(rgb), depth, P)
    matches = match_features(C_scene, MODELS)
    hypotheses = group_correspondences(matches, C_scene, MODELS)
    return verify_hypotheses(project_hypotheses(hypotheses, MODELS), depth, P)


@pytest.fixture(scope="module", params=SCENES)
def results(request):
    """(boxes, objects) of noisy pictures of random scenes."""
    found = []
    for seed in range(request.param):
        rng = np.random.default_rng(1000 + seed)
        boxes = random_boxes(rng)
        found.append((boxes, recognise(*with_noise(*render(boxes), rng))))
    return found


def errors(boxes, objects):
    """Distance and angle of each object to the box of its kind."""
    poses = {box.name: box.X_BO for box in boxes}
    return [pose_error(X_BK @ each.X, poses[model_label_of(each.label)]) for each in objects]


@pytest.mark.long
def test_something_is_recognised_in_every_scene_and_nearly_everything_in_all(results):
    counts = [len(objects) for _, objects in results]
    assert min(counts) >= 1
    assert sum(counts) >= 0.95 * 3 * len(results)


def test_nothing_is_recognised_that_is_not_there(results):
    for boxes, objects in results:
        labels = [each.label for each in objects]
        assert len(set(labels)) == len(labels)
        assert all(error[0] < 0.01 and error[1] < 0.12 for error in errors(boxes, objects))


def test_poses_are_good_enough_to_grasp(results):
    distances, angles = np.transpose([e for pair in results for e in errors(*pair)])
    assert np.median(distances) < 0.0005
    assert np.median(angles) < np.deg2rad(0.7)
    assert np.percentile(distances, 95) < 0.003
    assert np.percentile(angles, 95) < np.deg2rad(3)


def test_poses_have_no_bias(results):
    offsets = [
        (X_BK @ each.X)[:3, 3] - next(b.X_BO[:3, 3] for b in boxes if each.label.startswith(b.name))
        for boxes, objects in results
        for each in objects
    ]
    assert np.abs(np.mean(offsets, axis=0)).max() < 0.0002


def test_confidences_are_numbers_of_matches_over_numbers_of_features(results):
    for _, objects in results:
        for each in objects:
            model = next(m for m in MODELS if m.label == model_label_of(each.label))
            matched = each.confidence * len(model.C_sift.points)
            assert matched == pytest.approx(round(matched))
            assert 5 <= matched <= len(model.C_sift.points)


def test_an_empty_table_has_no_objects():
    rng = np.random.default_rng(5)
    assert recognise(*with_noise(*render(()), rng)) == ()


def test_two_boxes_of_a_kind_are_two_objects():
    boxes = (lying_box("sen", 0, 0.65, -0.45, 0.5), lying_box("sen", 0, 0.75, -0.1, 2.0))
    objects = recognise(*with_noise(*render(boxes), np.random.default_rng(6)))
    assert [each.label for each in objects] == ["sen_0", "sen_1"]
    for box in boxes:
        assert min(pose_error(X_BK @ each.X, box.X_BO)[0] for each in objects) < 0.003


def test_a_leaning_box_is_recognised():
    box = lying_box("mnich", 0, 0.7, -0.25, 0.8)
    tilt = np.deg2rad(25)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    box.X_BO[:3, :3] = turn @ box.X_BO[:3, :3]
    box.X_BO[2, 3] += 0.02
    objects = recognise(*with_noise(*render((box,)), np.random.default_rng(7)))
    ((distance, angle),) = errors((box,), objects)
    assert distance < 0.003
    assert angle < np.deg2rad(3)


def test_a_worker_thread_recognises_exactly_the_same():
    rng = np.random.default_rng(8)
    picture = with_noise(*render(random_boxes(rng)), rng)
    here = recognise(*picture)

    def afresh():
        matching._INDEXES.clear()
        return recognise(*picture)

    with ThreadPoolExecutor(1) as worker:
        runs = [here, worker.submit(afresh).result(), worker.submit(recognise, *picture).result()]
    for one, other in pairwise(runs):
        assert len(one) == len(other) >= 2
        for a, b in zip(one, other, strict=True):
            assert (a.label, a.confidence) == (b.label, b.confidence)
            np.testing.assert_array_equal(a.X, b.X)
            np.testing.assert_array_equal(a.C_rgb.points, b.C_rgb.points)
