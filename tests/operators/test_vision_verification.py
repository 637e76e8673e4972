"""HP and HV: models are put where hypotheses say, and only what the depth bears out stays."""

from functools import cache

import numpy as np
import pytest
from specc_runtime.operators.vision.camera import kinect_intrinsics
from specc_runtime.operators.vision.hypotheses import project_hypotheses
from specc_runtime.operators.vision.values import PoseHypothesis, model_label_of
from specc_runtime.operators.vision.verification import verify_hypotheses

from tests.operators.synthetic_camera import (
    MODELS,
    NAMES,
    X_BK,
    lying_box,
    render,
    with_noise,
)

P = kinect_intrinsics()
MINT = lying_box("herbapol_mint_tea", 0, 0.70, -0.35, 0.3)
MONK = lying_box("mnich", 2, 0.75, -0.10, -1.0)


@cache
def depth_of_both() -> np.ndarray:
    return render((MINT, MONK))[1]


def hypothesis(target, support=20, moved=(0.0, 0.0, 0.0)):
    X_KO = np.linalg.inv(X_BK) @ target.X_BO
    X_KO[:3, 3] += moved
    return PoseHypothesis(NAMES.index(target.name), X_KO, support)


def verified(*hypotheses, depth=None):
    depth = depth_of_both() if depth is None else depth
    return verify_hypotheses(project_hypotheses(hypotheses, MODELS), depth, P)


def test_projection_moves_the_whole_model():
    guess = hypothesis(MONK, support=30)
    (seen,) = project_hypotheses((guess,), MODELS)
    model, X = MODELS[1], guess.X_KO
    np.testing.assert_array_equal(seen.X, X)
    for cloud, original in ((seen.C_rgb, model.C_rgb), (seen.C_sift, model.C_sift)):
        np.testing.assert_allclose(cloud.points, original.points @ X[:3, :3].T + X[:3, 3])
    np.testing.assert_allclose(seen.C_sift.seen_from, model.C_sift.seen_from @ X[:3, :3].T)
    assert seen.confidence == 30 / len(model.C_sift.points)
    assert model_label_of(seen.label) == "mnich"
    np.testing.assert_array_equal(seen.size, model.size)


def test_true_hypotheses_are_accepted_with_and_without_noise():
    noisy = with_noise(np.zeros((480, 640, 3)), depth_of_both(), np.random.default_rng(1))[1]
    for depth in (depth_of_both(), noisy):
        labels = {seen.label for seen in verified(hypothesis(MINT), hypothesis(MONK), depth=depth)}
        assert labels == {"herbapol_mint_tea_0", "mnich_0"}


@pytest.mark.parametrize(
    "moved",
    [(0, 0, -0.05), (0, 0, -0.3), (0.2, 0.1, 0), (0.06, 0, 0)],
    ids=["above", "in the air", "over the table", "half beside"],
)
def test_a_model_that_the_scene_is_seen_behind_is_rejected(moved):
    assert verified(hypothesis(MINT, moved=moved)) == ()


def test_a_hypothesis_below_the_table_has_nothing_to_speak_for_it():
    assert verified(hypothesis(MINT, moved=(0, 0, 0.1))) == ()


def test_the_weaker_of_two_in_conflict_is_rejected():
    turned = hypothesis(MINT)
    turned.X_KO[:3, :3] = turned.X_KO[:3, :3] @ np.diag([-1.0, -1.0, 1.0])
    shifted = hypothesis(MINT, moved=(0.012, 0.004, 0.004))
    for pair in ((shifted, hypothesis(MINT)), (hypothesis(MINT), shifted)):
        (seen,) = verified(*pair)
        np.testing.assert_array_equal(seen.X, hypothesis(MINT).X_KO)
    assert len(verified(turned, hypothesis(MINT))) == 1


def test_something_nearer_does_not_speak_against_what_it_hides():
    half_hidden = depth_of_both().copy()
    X_KO = np.linalg.inv(X_BK) @ MINT.X_BO
    column = round(525 * X_KO[0, 3] / X_KO[2, 3] + 319.5)
    half_hidden[:, :column] = 0.7
    assert len(verified(hypothesis(MINT), depth=half_hidden)) == 1
    assert verified(hypothesis(MINT), depth=np.full_like(depth_of_both(), 0.7)) == ()


def test_where_nothing_was_read_nothing_is_known():
    assert verified(hypothesis(MINT), depth=np.zeros_like(depth_of_both())) == ()


def test_a_hypothesis_out_of_the_picture_is_rejected():
    assert verified(hypothesis(MINT, moved=(2.0, 0, 0))) == ()


def test_two_of_a_kind_are_numbered():
    other = lying_box("mnich", 2, 0.62, -0.5, 0.2)
    depth = render((MONK, other))[1]
    seen = verified(hypothesis(MONK), hypothesis(other), depth=depth)
    assert [each.label for each in seen] == ["mnich_0", "mnich_1"]


def test_nothing_in_nothing_out():
    assert verified() == ()
