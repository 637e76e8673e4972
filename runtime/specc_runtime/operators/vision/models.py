"""Object models (eqs 32 and 33), made from the meshes and textures of the objects themselves.

Models are made anew at every start, which is quick enough, so none can be stale.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.vision import opencv
from specc_runtime.operators.vision.mesh import Face, read_box
from specc_runtime.operators.vision.values import (
    Cloud,
    Descriptors,
    FeatureCloud,
    Image,
    ObjectModel,
)

DENSE_SPACING_M = 0.003
# The Kinect sees the table with about 460 pixels a metre. SIFT finds most of its features near
# the scale of the picture, hence one scale near that and one for what is seen larger.
FEATURE_SCALES_PX_PER_M = (480.0, 700.0)
MARGIN_PX = 12


def load_models(directory: str) -> tuple[ObjectModel, ...]:
    """The models of all NAME.obj with NAME.png in the directory, by name (eq. 32).

    Raises OSError if there is none or a file cannot be read, ValueError if a mesh is not a box.
    """
    meshes = sorted(Path(directory).glob("*.obj"))
    if not meshes:
        raise OSError(f"no object (NAME.obj) in {directory}")
    # OpenCV lets other threads run; a start has nothing else to do meanwhile.
    with ThreadPoolExecutor() as threads:
        return tuple(threads.map(make_model, meshes))


def make_model(mesh: Path) -> ObjectModel:
    """The model of one object; its label is the name of the files."""
    atlas = opencv.read_rgb(str(mesh.with_suffix(".png")))
    faces = [(face, _cut(atlas, face)) for face in read_box(mesh)]
    corners = np.array([face.corner for face, _ in faces])
    return ObjectModel(
        label=mesh.stem,
        C_rgb=_dense_cloud(faces),
        C_sift=_feature_cloud(faces),
        size=np.ptp(corners, axis=0),
    )


def _cut(atlas: Image, face: Face) -> Image:
    height, width = atlas.shape[:2]
    left, upper, right, lower = face.atlas
    rows = slice(round(upper * height), round(lower * height))
    return atlas[rows, round(left * width) : round(right * width)]


def _dense_cloud(faces: list[tuple[Face, Image]]) -> Cloud:
    points, colours = [], []
    for face, picture in faces:
        small = _scaled(picture, face, 1 / DENSE_SPACING_M)
        rows, columns = small.shape[:2]
        below, across = (np.indices((rows, columns)).reshape(2, -1) + 0.5) / [[rows], [columns]]
        points.append(face.points(across, below))
        colours.append(small.reshape(-1, 3))
    return Cloud(np.concatenate(points), np.concatenate(colours))


def _feature_cloud(faces: list[tuple[Face, Image]]) -> FeatureCloud:
    parts = [
        (points, np.tile(face.normal, (len(points), 1)), descriptors)
        for face, picture in faces
        for points, descriptors in _face_features(face, picture)
    ]
    points, normals, descriptors = (np.concatenate(column) for column in zip(*parts, strict=True))
    return FeatureCloud(points, normals, descriptors)


def _face_features(face: Face, picture: Image) -> Iterator[tuple[Array, Descriptors]]:
    """Places in O and descriptors of the features of a face, one pair for each scale."""
    for px_per_m in FEATURE_SCALES_PX_PER_M:
        scaled = _scaled(picture, face, px_per_m)
        # SIFT ignores a few pixels along the border of a picture; the margin gives them back.
        pixels, descriptors = opencv.sift(np.pad(opencv.to_gray(scaled), MARGIN_PX, mode="edge"))
        rows, columns = scaled.shape[:2]
        across = (pixels[:, 0] - MARGIN_PX + 0.5) / columns
        below = (pixels[:, 1] - MARGIN_PX + 0.5) / rows
        inside = (across > 0) & (across < 1) & (below > 0) & (below < 1)
        yield face.points(across[inside], below[inside]), descriptors[inside]


def _scaled(picture: Image, face: Face, px_per_m: float) -> Image:
    width_px = round(float(np.linalg.norm(face.right)) * px_per_m)
    height_px = round(float(np.linalg.norm(face.down)) * px_per_m)
    return opencv.resize(picture, width_px, height_px)
