"""CG: clusters of matches that one rigid motion explains (eqs 47 and 48)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.vision.rigid import fit_rigid
from specc_runtime.operators.vision.values import (
    FeatureCloud,
    Matches,
    ObjectModel,
    PoseHypothesis,
    move_points,
)

Indices = NDArray[np.int64]

DISTANCE_TOLERANCE_M = 0.010
FIT_TOLERANCE_M = 0.008
FITS = 4
MIN_CLUSTER = 5
# A cluster narrower than this leaves the orientation to the noise of the depth.
MIN_SPREAD_M = 0.006
MAX_VIEW_ANGLE_COSINE = 0.1


def group_correspondences(
    matches: Matches, C_scene: FeatureCloud, models: tuple[ObjectModel, ...]
) -> tuple[PoseHypothesis, ...]:
    """CG (eq. 47): the poses X_KO (eq. 48) of clusters of at least MIN_CLUSTER matches.

    Geometric consistency (Chen and Bhanu): two matches agree if their features are as far apart in
    the scene as in the model. Each cluster gives a hypothesis; its matches serve no other.
    """
    hypotheses: list[PoseHypothesis] = []
    for number, model in enumerate(models):
        chosen = matches.model == number
        scene_rows, model_rows = matches.scene[chosen], matches.feature[chosen]
        pairs = _Pairs(model.C_sift, C_scene, model_rows, scene_rows)
        for X_KO, cluster in pairs.clusters():
            hypotheses.append(PoseHypothesis(number, X_KO, len(cluster)))
    return tuple(hypotheses)


class _Pairs:
    """The matches of one model: places and directions in the model and in the scene."""

    def __init__(
        self, model: FeatureCloud, scene: FeatureCloud, model_rows: Indices, scene_rows: Indices
    ) -> None:
        self.p_O, self.n_O = model.points[model_rows], model.seen_from[model_rows]
        self.p_K, self.n_K = scene.points[scene_rows], scene.seen_from[scene_rows]

    def clusters(self) -> list[tuple[Array, Indices]]:
        """Poses X_KO and the matches of their clusters, in the order in which they are found."""
        agree = _agreement(self.p_O, self.p_K)
        free = np.ones(len(self.p_O), bool)
        found: list[tuple[Array, Indices]] = []
        while True:
            seed = _largest_group(agree & free[:, None] & free[None, :])
            if len(seed) < MIN_CLUSTER:
                return found
            free[seed] = False
            X_KO, cluster = self._refine(seed, free)
            if len(cluster) >= MIN_CLUSTER and _spread(self.p_O[cluster]) >= MIN_SPREAD_M:
                free[cluster] = False
                found.append((X_KO, cluster))

    def _refine(self, seed: Indices, free: NDArray[np.bool_]) -> tuple[Array, Indices]:
        """Fit, take all matches that the fit explains, and fit again."""
        open_to = free.copy()
        open_to[seed] = True
        cluster = seed
        for _ in range(FITS):
            X_KO = fit_rigid(self.p_O[cluster], self.p_K[cluster])
            error = np.linalg.norm(move_points(X_KO, self.p_O) - self.p_K, axis=1)
            facing = np.sum((self.n_O @ X_KO[:3, :3].T) * self.n_K, axis=1)
            explained = (error < FIT_TOLERANCE_M) & (facing > MAX_VIEW_ANGLE_COSINE)
            cluster = np.flatnonzero(explained & open_to)
            if len(cluster) < MIN_CLUSTER:
                break
        return X_KO, cluster


def _agreement(p_O: Array, p_K: Array) -> NDArray[np.bool_]:
    """(n, n): pairs of matches that are as far apart in the model as in the scene."""
    between_O = np.linalg.norm(p_O[:, None] - p_O[None, :], axis=2)
    between_K = np.linalg.norm(p_K[:, None] - p_K[None, :], axis=2)
    agree: NDArray[np.bool_] = np.abs(between_O - between_K) < DISTANCE_TOLERANCE_M
    return agree


def _largest_group(agree: NDArray[np.bool_]) -> Indices:
    """A group in which all agree with all: grown greedily from the match with most company."""
    company = agree.sum(axis=1)
    if not company.any():
        return np.empty(0, np.int64)
    group: list[int] = []
    candidates = agree[int(np.argmax(company))].copy()
    while candidates.any():
        joining = int(np.argmax(np.where(candidates, company, -1)))
        group.append(joining)
        candidates &= agree[joining]
        candidates[joining] = False
    return np.array(group)


def _spread(points: Array) -> float:
    """Root mean square extent of the points along their second widest direction, in metres."""
    singular_values = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(singular_values[1] / np.sqrt(len(points)))
