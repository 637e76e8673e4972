"""Meshes with no more triangles than a picture can show."""

from __future__ import annotations

from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

_FEWEST = 5000
"""Triangles of a mesh that stays as it is."""
_FINEST, _STEP = 1024, 0.8
"""Cells along the longest edge of a mesh, and what is left of them from one try to the next."""

_ALIKE = 0.7
"""Cosine of the angle up to which two normals are those of a smooth surface."""


def coarse(model: Any, most: int) -> Any:
    """A copy of a model, for drawing, whose meshes have about `most` triangles together.

    The corners of each cell of a grid become the one that is nearest to their mean. A smooth
    surface stays smooth, and an edge an edge: a corner takes the normal of the one that it becomes,
    unless the two are far from each other. Texture coordinates stay.
    """
    made = copy(model)
    counts = model.mesh_facenum.astype(np.int64)
    large = counts > _FEWEST
    if not large.any() or counts.sum() <= most:
        return made
    share = max(0.0, (most - counts[~large].sum()) / counts[large].sum())
    for mesh in np.flatnonzero(large):
        _reduce(made, int(mesh), max(_FEWEST, int(counts[mesh] * share)))
    return made


def _reduce(model: Any, mesh: int, most: int) -> None:
    """Leave so many triangles of a mesh."""
    begin = int(model.mesh_faceadr[mesh])
    faces = slice(begin, begin + int(model.mesh_facenum[mesh]))
    corners = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    before = model.mesh_face[faces].copy()
    triangles, indices = _joined(corners, before, most)
    end = begin + len(indices)
    normals = model.mesh_normal[model.mesh_normaladr[mesh] :][: model.mesh_normalnum[mesh]]
    turned = _normals(normals, model.mesh_facenormal[faces], before, triangles, indices)
    model.mesh_face[begin:end] = triangles
    model.mesh_facenormal[begin:end] = turned
    model.mesh_facetexcoord[begin:end] = model.mesh_facetexcoord[faces][indices]
    model.mesh_facenum[mesh] = len(indices)


def _normals(
    normals: NDArray[np.float32],
    own: NDArray[np.int32],
    before: NDArray[np.int32],
    triangles: NDArray[np.int64],
    indices: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Which normals the corners of the triangles that are left have (n, 3)."""
    one = np.zeros(before.max() + 1, np.int64)
    one[before.ravel()] = own.ravel()
    corners_of, old = one[triangles], own[indices].astype(np.int64)
    alike = (normals[corners_of] * normals[old]).sum(axis=2) > _ALIKE
    return np.where(alike, corners_of, old)


def _joined(
    corners: NDArray[np.float32], triangles: NDArray[np.int32], most: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The triangles (n, 3) that are left once corners are joined, and which ones these were."""
    low, cells = corners.min(axis=0), float(_FINEST)
    edge = float((corners.max(axis=0) - low).max()) or 1.0
    while True:
        place = np.floor((corners - low) * (cells / edge)).astype(np.int64)
        keys = (place[:, 0] * 2048 + place[:, 1]) * 2048 + place[:, 2]
        _, of = np.unique(keys, return_inverse=True)
        a, b, c = of[triangles].T
        indices = np.flatnonzero((a != b) & (b != c) & (a != c))
        if len(indices) <= most or cells < 2:
            return _nearest(corners, of)[of[triangles[indices]]], indices
        cells *= _STEP


def _nearest(corners: NDArray[np.float32], of: NDArray[np.int64]) -> NDArray[np.int64]:
    """For each group the corner that is nearest to the mean of its corners."""
    count = np.bincount(of)
    mean = np.stack([np.bincount(of, axis) / count for axis in corners.T], axis=1)
    far = ((corners - mean[of]) ** 2).sum(axis=1)
    order = np.lexsort((far, of))
    first: NDArray[np.int64] = order[np.concatenate(([0], np.cumsum(count)[:-1]))]
    return first
