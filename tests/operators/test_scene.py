"""TO, US and GO: laws of the memory of the scene (eq. 64) and what can be picked (eq. 67)."""

from dataclasses import replace

import numpy as np
import pytest
from specc_runtime.builtins import argmax
from specc_runtime.operators.scene import (
    FORGOTTEN_BELOW,
    graspable_objects,
    transform_objects,
    update_scene,
)
from specc_runtime.operators.vision.values import Cloud, FeatureCloud, Object

from tests.operators.synthetic_camera import X_BK, lying_box


def thing(label, x=0.75, y=-0.25, yaw=0.0, confidence=0.03, lying=0):
    """A recognised box of the size of "sen" on the table."""
    box = lying_box("sen", lying, x, y, yaw)
    points = box.X_BO[:3, 3] + np.array([[0.01, 0, 0], [0, 0.02, 0.005]])
    cloud = Cloud(points, np.zeros((2, 3), np.uint8))
    up = np.tile(box.X_BO[:3, 2], (2, 1))
    features = FeatureCloud(points, up, np.zeros((2, 128), np.float32))
    return Object(cloud, features, box.X_BO, confidence, label, box.size)


X_PG = np.eye(4)
X_PG[2, 3] = 0.2
Q_BEFORE = np.array([0.0, -np.pi / 2, 0.0, 0.0, 1.5 * np.pi, -np.pi / 2])


def best(objects):
    """What is picked (eq. 67)."""
    return most_confident(graspable_objects(objects, np.eye(4), X_PG, Q_BEFORE))


def most_confident(objects):
    return argmax((each.confidence, each) for each in objects)


def confidences(objects):
    return {each.label: each.confidence for each in objects}


def test_transforming_moves_pose_and_clouds_together():
    known = thing("sen_0")
    (moved,) = transform_objects(X_BK, (known,))
    inside = np.linalg.inv(known.X) @ np.c_[known.C_rgb.points, np.ones(2)].T
    again = np.linalg.inv(moved.X) @ np.c_[moved.C_rgb.points, np.ones(2)].T
    np.testing.assert_allclose(again, inside, atol=1e-12)
    np.testing.assert_array_equal(moved.C_sift.points, moved.C_rgb.points)
    np.testing.assert_allclose(
        moved.C_sift.seen_from @ moved.X[:3, :3],
        known.C_sift.seen_from @ known.X[:3, :3],
        atol=1e-12,
    )
    assert (moved.label, moved.confidence) == (known.label, known.confidence)
    (back,) = transform_objects(np.linalg.inv(X_BK), (moved,))
    np.testing.assert_allclose(back.X, known.X, atol=1e-12)


def test_the_first_sight_is_remembered_as_it_is():
    seen = (thing("sen_0"), thing("mnich_0", y=0.0))
    scene = update_scene((), seen)
    assert confidences(scene) == confidences(seen)
    for one, other in zip(scene, seen, strict=True):
        np.testing.assert_array_equal(one.X, other.X)


def test_what_is_seen_again_is_merged_as_the_paper_says():
    old, new = thing("sen_0", confidence=0.05), thing("sen_0", x=0.756, yaw=0.05, confidence=0.02)
    (merged,) = update_scene((old,), (new,))
    assert merged.confidence == pytest.approx(0.05 / 2 + 0.02)
    np.testing.assert_array_equal(merged.X, new.X)
    assert merged.C_rgb is new.C_rgb
    assert merged.C_sift is new.C_sift


def test_confidence_of_what_stays_tends_to_twice_that_of_a_sight():
    scene = ()
    for _ in range(30):
        scene = update_scene(scene, (thing("sen_0", confidence=0.02),))
    assert confidences(scene) == {"sen_0": pytest.approx(0.04)}


def test_another_model_at_the_same_place_is_another_object():
    scene = update_scene((thing("sen_0", confidence=0.02),), (thing("mnich_0", confidence=0.03),))
    assert confidences(scene) == {"mnich_0": 0.03, "sen_0": 0.01}


@pytest.mark.parametrize("change", [{"x": 0.82}, {"yaw": 0.6}, {"lying": 1}])
def test_what_lies_differently_is_not_promoted_and_leaves_no_ghost(change):
    old, new = thing("sen_0", confidence=0.1), thing("sen_0", confidence=0.02, **change)
    (moved,) = update_scene((old,), (new,))
    np.testing.assert_array_equal(moved.X, new.X)
    assert moved.confidence == 0.02


def test_two_of_a_kind_keep_their_labels_whatever_vision_calls_them():
    left, right = thing("sen_0", y=-0.4, confidence=0.03), thing("sen_1", y=-0.1, confidence=0.02)
    seen = (replace(right, label="sen_0"), replace(left, label="sen_1"))
    scene = {each.label: each for each in update_scene((left, right), seen)}
    assert scene["sen_0"].X[1, 3] == pytest.approx(-0.4)
    assert scene["sen_1"].X[1, 3] == pytest.approx(-0.1)


def test_a_second_of_a_kind_that_arrives_gets_a_label_of_its_own():
    known = thing("sen_0", y=-0.4)
    scene = update_scene((known,), (thing("sen_0", y=-0.1), thing("sen_1", y=-0.4)))
    assert sorted(confidences(scene)) == ["sen_0", "sen_1"]
    assert next(e for e in scene if e.label == "sen_0").X[1, 3] == pytest.approx(-0.4)


def test_what_is_not_seen_again_fades_and_is_forgotten():
    scene = (thing("sen_0", confidence=0.04),)
    history = []
    while scene:
        history.append(scene[0].confidence)
        scene = update_scene(scene, ())
    assert history == [0.04, 0.02, 0.01, 0.005]
    assert history[-1] / 2 < FORGOTTEN_BELOW


def test_what_is_seen_outranks_what_is_only_remembered():
    ghost = thing("sen_0", confidence=1.0)
    scene = update_scene((ghost,), (thing("mnich_0", y=0.0, confidence=0.012),))
    assert most_confident(scene).label == "mnich_0"
    assert confidences(scene)["sen_0"] == pytest.approx(0.006)


def test_labels_in_a_scene_are_unique_in_a_long_history():
    rng = np.random.default_rng(1)
    scene = ()
    for _ in range(60):
        count = int(rng.integers(4))
        seen = tuple(
            thing(f"sen_{n}", rng.uniform(0.6, 0.9), rng.uniform(-0.5, 0), confidence=0.02)
            for n in range(count)
        )
        scene = update_scene(scene, seen)
        assert len(confidences(scene)) == len(scene)
        for one in seen:
            assert any(np.array_equal(one.X, each.X) for each in scene)


def test_what_cannot_be_grasped_is_not_selected_while_something_can():
    far, near = thing("sen_0", x=1.4, confidence=0.9), thing("sen_1", confidence=0.01)
    assert best((far, near)) is near
    assert graspable_objects((far,), np.eye(4), X_PG, Q_BEFORE) == ()


def with_surface(each):
    """The object with a dense cloud: a grid on the top and the sides of its box."""
    grid = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 25)] * 3), axis=-1).reshape(-1, 3)
    surface = grid[np.abs(grid).max(axis=1) == 0.5] * each.size
    points = surface @ each.X[:3, :3].T + each.X[:3, 3]
    return replace(each, C_rgb=Cloud(points, np.zeros(points.shape, np.uint8)))


@pytest.mark.parametrize(("gap", "hindered"), [(0.010, True), (0.030, True), (0.050, False)])
def test_what_stands_close_to_another_is_picked_later(gap, hindered):
    size = thing("sen_0").size
    close = with_surface(thing("sen_0", y=-0.4, confidence=0.09))
    wall = with_surface(thing("sen_1", y=-0.4 + size[1] + gap, confidence=0.01))
    alone = with_surface(thing("sen_2", y=0.0, confidence=0.03))
    assert best((close, wall, alone)) is (alone if hindered else close)
    assert best((close, wall)) is close


def test_a_low_neighbour_under_the_hand_does_not_hinder_but_a_tall_one_does():
    target = with_surface(thing("sen_0", y=-0.4, confidence=0.09))
    alone = with_surface(thing("sen_2", y=0.05, confidence=0.03))
    low = thing("sen_1", y=-0.4 + target.size[1] + 0.039, confidence=0.01)
    assert best((target, with_surface(low), alone)) is target
    raised = low.X.copy()
    raised[2, 3] += 0.08
    tall = replace(low, X=raised, size=low.size + np.array([0, 0, 0.16]))
    assert best((target, with_surface(tall), alone)) is alone


def test_arguments_are_left_alone():
    old, new = thing("sen_0", confidence=0.05), thing("sen_0", confidence=0.02)
    before = (old.X.copy(), new.X.copy())
    update_scene((old,), (new,))
    transform_objects(X_BK, (old,))
    np.testing.assert_array_equal((old.X, new.X), before)
    assert (old.confidence, new.confidence) == (0.05, 0.02)
