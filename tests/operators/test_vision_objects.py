"""The committed objects are what their script makes."""

import subprocess
import sys

import cv2
import numpy as np
import pytest

from tests.operators.synthetic_camera import NAMES, OBJECTS


@pytest.mark.long
def test_the_script_makes_the_committed_meshes_and_textures(tmp_path):
    (tmp_path / "objects.json").write_text((OBJECTS / "objects.json").read_text())
    subprocess.run([sys.executable, OBJECTS / "make_objects.py", tmp_path], check=True)
    for name in NAMES:
        assert (tmp_path / f"{name}.obj").read_text() == (OBJECTS / f"{name}.obj").read_text()
        made, committed = (
            cv2.imread(str(folder / f"{name}.png")).astype(int) for folder in (tmp_path, OBJECTS)
        )
        assert made.shape == committed.shape
        # Releases of OpenCV differ a little in how they smooth edges.
        assert np.abs(made - committed).mean() < 2


def test_textures_are_small_enough_to_be_kept_with_the_sources():
    for name in NAMES:
        assert (OBJECTS / f"{name}.png").stat().st_size <= 400_000


def test_no_two_faces_are_alike():
    faces = []
    for name in NAMES:
        atlas = cv2.imread(str(OBJECTS / f"{name}.png"), cv2.IMREAD_GRAYSCALE).astype(float)
        uvs = [
            [float(word) for word in line.split()[1:]]
            for line in (OBJECTS / f"{name}.obj").read_text().splitlines()
            if line.startswith("vt ")
        ]
        height, width = atlas.shape
        for quad in np.array(uvs).reshape(6, 4, 2):
            (left, low), (right, high) = quad.min(axis=0), quad.max(axis=0)
            rows = slice(round((1 - high) * height), round((1 - low) * height))
            face = atlas[rows, round(left * width) : round(right * width)]
            faces.append(cv2.resize(face, (64, 64), interpolation=cv2.INTER_AREA).ravel())
    alike = np.corrcoef(faces) - np.eye(len(faces))
    assert np.abs(alike).max() < 0.5
