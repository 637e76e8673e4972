"""FM: matches are right, distinct, and the same in every call and thread."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from specc_runtime.operators.vision import matching
from specc_runtime.operators.vision.matching import match_features
from specc_runtime.operators.vision.models import load_models
from specc_runtime.operators.vision.values import FeatureCloud

from tests.operators.synthetic_camera import MODELS, OBJECTS


def disturbed(model, rows, rng, strength):
    """Features of a model as a scene might show them: their descriptors with noise."""
    descriptors = model.C_sift.descriptors[rows]
    noise = rng.normal(0, strength, descriptors.shape).astype(np.float32)
    nowhere = np.zeros((len(rows), 3))
    return FeatureCloud(nowhere, nowhere, np.clip(descriptors + noise, 0, 255))


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name))
        for name in ("scene", "model", "feature")
    )


@pytest.mark.parametrize("number", range(3))
def test_disturbed_features_find_themselves(number):
    rng = np.random.default_rng(number)
    model = MODELS[number]
    rows = rng.choice(len(model.C_sift.points), 200, replace=False)
    matches = match_features(disturbed(model, rows, rng, 5.0), MODELS)
    places = model.C_sift.points
    right = (matches.model == number) & (
        np.linalg.norm(places[matches.feature] - places[rows[matches.scene]], axis=1)
        < matching.SAME_PLACE_M
    )
    assert len(matches.scene) >= 150
    assert right.mean() >= 0.99


def test_features_of_nothing_known_are_seldom_matched():
    rng = np.random.default_rng(4)
    strange = rng.gamma(0.6, 40.0, (300, 128)).clip(0, 180).astype(np.float32)
    cloud = FeatureCloud(np.zeros((300, 3)), np.zeros((300, 3)), strange)
    assert len(match_features(cloud, MODELS).scene) <= 6


def test_no_features_give_no_matches():
    nothing = np.empty((0, 3))
    cloud = FeatureCloud(nothing, nothing, np.empty((0, 128), np.float32))
    assert len(match_features(cloud, MODELS).scene) == 0


def test_a_feature_that_two_objects_share_is_not_matched():
    twin = load_models(str(OBJECTS))[0]
    rows = np.arange(50)
    cloud = disturbed(twin, rows, np.random.default_rng(5), 3.0)
    assert len(match_features(cloud, (MODELS[0],)).scene) >= 40
    assert len(match_features(cloud, (MODELS[0], twin)).scene) == 0


def test_the_search_is_as_good_as_an_exhaustive_one():
    rng = np.random.default_rng(6)
    known = np.concatenate([model.C_sift.descriptors for model in MODELS])
    rows = rng.choice(len(known), 300, replace=False)
    queries = known[rows] + rng.normal(0, 12, (300, 128)).astype(np.float32)
    found, distances = matching.opencv.nearest(matching._index(MODELS), queries, 2)
    exact = np.stack([np.linalg.norm(query - known, axis=1) for query in queries])
    assert np.mean(found[:, 0] == exact.argmin(axis=1)) >= 0.98
    np.testing.assert_allclose(
        distances[:, 0], np.take_along_axis(exact, found[:, :1], 1)[:, 0], rtol=1e-4
    )
    assert (distances[:, 0] <= distances[:, 1]).all()


def test_training_again_and_in_another_thread_changes_nothing():
    rng = np.random.default_rng(7)
    cloud = disturbed(MODELS[1], np.arange(400), rng, 25.0)
    first = match_features(cloud, MODELS)

    def afresh():
        matching._INDEXES.clear()
        return match_features(cloud, MODELS)

    assert same(first, afresh())
    with ThreadPoolExecutor(1) as worker:
        assert same(first, worker.submit(afresh).result())
        assert same(first, worker.submit(match_features, cloud, MODELS).result())
