"""HV: greedy verification of projected hypotheses against the depth of the scene (eq. 50).

The paper's HV takes the hypotheses alone; counting what fits the scene needs the scene, so the
depth map and the intrinsic parameters come with them.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.vision.camera import Intrinsics, project
from specc_runtime.operators.vision.values import Depth, Object, label_of, model_label_of

INLIER_M = 0.010
# Outliers weigh this much more than inliers, as in the published verification (lambda).
OUTLIER_WEIGHT = 1.5
MIN_INLIERS = 12
MIN_FACING_COSINE = 0.3
CLAIM_CELL_PX = 4


@dataclass(frozen=True, slots=True, eq=False)
class _Evidence:
    """How the visible features of a projected model fare: cells of the picture they lie in.

    `inliers` (n, 2) lie on a surface of the scene, `outliers` are those the scene is seen behind.
    A feature hidden by something nearer speaks neither for nor against.
    """

    inliers: NDArray[np.int64]
    outliers: int

    @property
    def score(self) -> float:
        return len(self.inliers) - OUTLIER_WEIGHT * self.outliers


def verify_hypotheses(
    objects: tuple[Object, ...], I_depth: Depth, P: Intrinsics
) -> tuple[Object, ...]:
    """HV (eq. 50): the objects in K whose models fit the scene, without conflicts, best first.

    Greedy: hypotheses in the order of their scores; what lies where an accepted one already
    explains the scene counts as an outlier. Accepted if the inliers outweigh the outliers.
    Labels are numbered anew for each model.
    """
    weighed = [(_weigh(candidate, I_depth, P), candidate) for candidate in objects]
    weighed.sort(key=lambda pair: -pair[0].score)
    claimed: set[tuple[int, int]] = set()
    accepted: Counter[str] = Counter()
    verified: list[Object] = []
    for evidence, candidate in weighed:
        cells = [(int(row), int(column)) for row, column in evidence.inliers]
        inliers = sum(cell not in claimed for cell in cells)
        outliers = evidence.outliers + len(cells) - inliers
        if inliers >= MIN_INLIERS and inliers > OUTLIER_WEIGHT * outliers:
            model_label = model_label_of(candidate.label)
            verified.append(replace(candidate, label=label_of(model_label, accepted[model_label])))
            accepted[model_label] += 1
            claimed.update(cells)
    return tuple(verified)


def _weigh(candidate: Object, I_depth: Depth, P: Intrinsics) -> _Evidence:
    points, seen_from = candidate.C_sift.points, candidate.C_sift.seen_from
    to_camera = -points / np.linalg.norm(points, axis=1, keepdims=True)
    points = points[np.sum(seen_from * to_camera, axis=1) > MIN_FACING_COSINE]
    pixels = np.rint(project(points, P)).astype(np.int64)
    height, width = I_depth.shape
    inside = ((pixels >= 0) & (pixels < (width, height))).all(axis=1)
    pixels, depth = pixels[inside], points[inside, 2]
    measured = I_depth[pixels[:, 1], pixels[:, 0]]
    behind = np.where(measured > 0, measured - depth, -np.inf)
    inliers = pixels[np.abs(behind) <= INLIER_M] // CLAIM_CELL_PX
    return _Evidence(inliers[:, ::-1], int(np.sum(behind > INLIER_M)))
