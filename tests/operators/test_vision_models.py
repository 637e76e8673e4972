"""Object models are made of what is on the boxes, and nothing else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from specc_runtime.operators.vision.mesh import read_box
from specc_runtime.operators.vision.models import DENSE_SPACING_M, load_models

from tests.operators.synthetic_camera import MODELS, NAMES, OBJECTS, box


def test_the_models_are_those_of_the_objects_in_the_order_of_their_names() -> None:
    assert tuple(model.label for model in MODELS) == NAMES
    sizes = ((0.140, 0.075, 0.064), (0.146, 0.077, 0.058), (0.114, 0.061, 0.073))
    for model, size in zip(MODELS, sizes, strict=True):
        np.testing.assert_allclose(model.size, size, atol=1e-6)


@pytest.mark.parametrize("model", MODELS, ids=NAMES)
def test_every_feature_lies_on_the_face_whose_normal_it_has(model) -> None:
    points, normals = model.C_sift.points, model.C_sift.seen_from
    np.testing.assert_allclose(np.abs(normals).sum(axis=1), 1, atol=1e-9)
    height = np.sum(points * normals, axis=1)
    np.testing.assert_allclose(height, np.abs(normals) @ model.size / 2, atol=1e-9)
    assert (np.abs(points) <= model.size / 2 + 1e-9).all()
    faces, counts = np.unique(np.round(normals), axis=0, return_counts=True)
    assert len(faces) == 6
    assert counts.min() >= 60


@pytest.mark.parametrize("model", MODELS, ids=NAMES)
def test_the_dense_cloud_covers_the_surface_evenly(model) -> None:
    x, y, z = model.size
    area = 2 * (x * y + y * z + z * x)
    assert len(model.C_rgb.points) == pytest.approx(area / DENSE_SPACING_M**2, rel=0.03)
    assert np.isclose(np.abs(model.C_rgb.points), model.size / 2).any(axis=1).all()


@pytest.mark.parametrize("model", MODELS, ids=NAMES)
def test_the_dense_cloud_has_the_colours_of_the_texture(model) -> None:
    target = box(model.label, np.eye(4))
    points = model.C_rgb.points
    axis = np.argmin(np.abs(np.abs(points) - target.size / 2), axis=1)
    side = 2 * axis + (np.take_along_axis(points, axis[:, None], 1)[:, 0] < 0)
    uv = np.einsum("nij,nj->ni", target.uv[side], np.c_[points, np.ones(len(points))])
    height, width = target.atlas.shape[:2]
    around = np.stack(
        [
            target.atlas[
                np.clip((1 - uv[:, 1]) * height + dv, 0, height - 1).astype(int),
                np.clip(uv[:, 0] * width + du, 0, width - 1).astype(int),
            ]
            for dv in (-3, -1, 1, 3)
            for du in (-3, -1, 1, 3)
        ]
    )
    difference = np.abs(around.mean(axis=0) - model.C_rgb.colours).mean(axis=1)
    assert np.percentile(difference, 95) < 30


def test_loading_twice_gives_the_same() -> None:
    for one, other in zip(MODELS, load_models(str(OBJECTS)), strict=True):
        np.testing.assert_array_equal(one.C_sift.points, other.C_sift.points)
        np.testing.assert_array_equal(one.C_sift.descriptors, other.C_sift.descriptors)


def test_a_folder_without_objects_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=r"no object"):
        load_models(str(tmp_path))


def test_a_mesh_without_its_texture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sen.obj").write_text((OBJECTS / "sen.obj").read_text())
    with pytest.raises(OSError, match=r"sen\.png"):
        load_models(str(tmp_path))


def test_a_face_that_is_no_rectangle_is_refused(tmp_path: Path) -> None:
    lines = (OBJECTS / "sen.obj").read_text().splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith("v "))
    lines[first] = "v 0.06 -0.0305 -0.02"
    (tmp_path / "sen.obj").write_text("\n".join(lines))
    with pytest.raises(ValueError, match="not a rectangle"):
        read_box(tmp_path / "sen.obj")
