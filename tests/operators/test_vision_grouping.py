"""CG: the clusters in a heap of matches, of which many are wrong."""

import numpy as np
import pytest
from specc_runtime.operators.vision.grouping import group_correspondences
from specc_runtime.operators.vision.rigid import fit_rigid
from specc_runtime.operators.vision.values import Cloud, FeatureCloud, Matches, ObjectModel

from tests.operators.synthetic_camera import pose_error


def random_pose(rng):
    w, x, y, z = (q := rng.normal(size=4)) / np.linalg.norm(q)
    X = np.eye(4)
    X[:3, :3] = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    X[:3, 3] = rng.uniform((-0.3, -0.3, 0.9), (0.3, 0.3, 1.2))
    return X


def plate(rng, features=80, size=(0.14, 0.07)):
    """A model with all its features on one face, z = 0, seen from +z."""
    points = np.c_[rng.uniform(-0.5, 0.5, (features, 2)) * size, np.zeros(features)]
    normals = np.tile((0.0, 0.0, 1.0), (features, 1))
    descriptors = np.zeros((features, 128), np.float32)
    dense = Cloud(points, np.zeros((features, 3), np.uint8))
    return ObjectModel("plate", dense, FeatureCloud(points, normals, descriptors), np.ones(3))


def facing_pose(rng):
    """A pose whose +z looks at the camera, at most 40 degrees aside."""
    while True:
        X = random_pose(rng)
        to_camera = -X[:3, 3] / np.linalg.norm(X[:3, 3])
        if X[:3, 2] @ to_camera > 0.77:
            return X


def scene_of(model, rng, poses, right, wrong, noise_m=0.0):
    """A scene in which the model lies at the poses; of its matches some are right, some wrong."""
    rows = [rng.choice(len(model.C_sift.points), right, replace=False) for _ in poses]
    seen = [
        model.C_sift.points[r] @ X[:3, :3].T + X[:3, 3] for r, X in zip(rows, poses, strict=True)
    ]
    stray = rng.uniform((-0.3, -0.3, 0.9), (0.3, 0.3, 1.2), (wrong, 3))
    points = np.concatenate([*seen, stray])
    points = points + rng.normal(0, noise_m, points.shape)
    feature = np.concatenate([*rows, rng.integers(len(model.C_sift.points), size=wrong)])
    to_camera = -points / np.linalg.norm(points, axis=1, keepdims=True)
    cloud = FeatureCloud(points, to_camera, np.zeros((len(points), 128), np.float32))
    count = len(points)
    return Matches(np.arange(count), np.zeros(count, np.int64), feature), cloud


@pytest.mark.parametrize("seed", range(8))
def test_a_rigid_motion_is_recovered(seed):
    rng = np.random.default_rng(seed)
    X = random_pose(rng)
    p_B = rng.normal(size=(12, 3))
    if seed % 2:
        p_B[:, 2] = 0
    fitted = fit_rigid(p_B, p_B @ X[:3, :3].T + X[:3, 3])
    np.testing.assert_allclose(fitted, X, atol=1e-9)


def test_a_fit_is_never_a_reflection():
    rng = np.random.default_rng(9)
    p_B = rng.normal(size=(30, 3))
    fitted = fit_rigid(p_B, p_B * (1, 1, -1) + rng.normal(0, 0.01, (30, 3)))
    assert np.linalg.det(fitted[:3, :3]) == pytest.approx(1)


@pytest.mark.parametrize("seed", range(10))
def test_one_object_is_found_among_twice_as_many_wrong_matches(seed):
    rng = np.random.default_rng(seed)
    model, X = plate(rng), facing_pose(rng)
    matches, cloud = scene_of(model, rng, [X], right=25, wrong=50, noise_m=0.0005)
    hypotheses = group_correspondences(matches, cloud, (model,))
    best = max(hypotheses, key=lambda hypothesis: hypothesis.support)
    distance, angle = pose_error(best.X_KO, X)
    assert 24 <= best.support <= 27
    assert distance < 0.001
    assert angle < np.deg2rad(1.5)


@pytest.mark.parametrize("seed", range(6))
def test_two_instances_of_one_model_give_two_hypotheses(seed):
    rng = np.random.default_rng(100 + seed)
    model = plate(rng)
    poses = [facing_pose(rng), facing_pose(rng)]
    poses[1][:3, 3] = poses[0][:3, 3] + (0.25, 0, 0)
    matches, cloud = scene_of(model, rng, poses, right=15, wrong=10)
    hypotheses = group_correspondences(matches, cloud, (model,))
    strong = [hypothesis for hypothesis in hypotheses if hypothesis.support >= 13]
    assert len(strong) == 2
    for X in poses:
        errors = [pose_error(hypothesis.X_KO, X) for hypothesis in strong]
        assert min(errors)[0] < 0.002


def test_four_matches_are_not_enough():
    rng = np.random.default_rng(11)
    model = plate(rng)
    matches, cloud = scene_of(model, rng, [facing_pose(rng)], right=4, wrong=0)
    assert group_correspondences(matches, cloud, (model,)) == ()


def test_wrong_matches_alone_give_nothing_strong():
    rng = np.random.default_rng(12)
    model = plate(rng)
    matches, cloud = scene_of(model, rng, [], right=0, wrong=80)
    assert all(h.support <= 6 for h in group_correspondences(matches, cloud, (model,)))


def test_a_face_that_looks_away_is_not_believed():
    rng = np.random.default_rng(13)
    model, X = plate(rng), facing_pose(rng)
    X[:3, 1:3] *= -1
    matches, cloud = scene_of(model, rng, [X], right=25, wrong=0)
    assert group_correspondences(matches, cloud, (model,)) == ()


def test_features_on_a_line_do_not_make_a_pose():
    rng = np.random.default_rng(14)
    model = plate(rng, size=(0.14, 0.004))
    matches, cloud = scene_of(model, rng, [facing_pose(rng)], right=25, wrong=0)
    assert group_correspondences(matches, cloud, (model,)) == ()


def test_no_matches_give_no_hypotheses():
    none = np.empty(0, np.int64)
    nothing = np.empty((0, 3))
    cloud = FeatureCloud(nothing, nothing, np.empty((0, 128), np.float32))
    model = plate(np.random.default_rng(15))
    assert group_correspondences(Matches(none, none, none), cloud, (model,)) == ()
