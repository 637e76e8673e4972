"""FM: matches between the features of the scene and those of all models (eq. 46)."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.vision import opencv
from specc_runtime.operators.vision.values import FeatureCloud, Matches, ObjectModel

MAX_RATIO = 0.8
NEIGHBOURS = 3
SAME_PLACE_M = 0.006
# By the first model of a set: the others, and the trees. They are as large as all clouds of the set
# and none outlives the run that has the models.
_INDEXES: WeakKeyDictionary[ObjectModel, tuple[tuple[ObjectModel, ...], opencv.NeighbourIndex]] = (
    WeakKeyDictionary()
)


def match_features(C_scene: FeatureCloud, models: tuple[ObjectModel, ...]) -> Matches:
    """FM (eq. 46): each scene feature with the model feature nearest in descriptor, if distinct.

    Distinct means nearer than MAX_RATIO times the nearest neighbour at another place (Lowe's test).
    A second neighbour at the same place of the same model, which the other scale of the model
    often gives, is no rival.
    """
    owner, feature, points = _numbering(models)
    rows, distances = opencv.nearest(_index(models), C_scene.descriptors, NEIGHBOURS)
    best, others = rows[:, :1], rows[:, 1:]
    apart = np.linalg.norm(points[others] - points[best], axis=2) > SAME_PLACE_M
    rival = apart | (owner[others] != owner[best])
    rival_distance = np.where(rival, distances[:, 1:], np.inf).min(axis=1)
    scene = np.flatnonzero(distances[:, 0] < MAX_RATIO * rival_distance)
    return Matches(scene, owner[rows[scene, 0]], feature[rows[scene, 0]])


def _numbering(
    models: tuple[ObjectModel, ...],
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """For each row of the common index: number of the model, of its feature, and place in O."""
    counts = [len(model.C_sift.points) for model in models]
    owner = np.repeat(np.arange(len(models)), counts)
    feature = np.concatenate([np.arange(count) for count in counts])
    return owner, feature, np.concatenate([model.C_sift.points for model in models])


def _index(models: tuple[ObjectModel, ...]) -> opencv.NeighbourIndex:
    """The search trees of a set of models; training takes longer than a whole search."""
    first, rest = models[0], models[1:]
    others, index = _INDEXES.get(first, ((), None))
    if index is None or others != rest:
        index = opencv.train(np.concatenate([model.C_sift.descriptors for model in models]))
        _INDEXES[first] = rest, index
    return index
