"""A box as it stands in a Wavefront OBJ file: rectangular faces with their places in an atlas."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from specc_runtime.operators.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """A rectangle: its upper left corner and its edges `right` and `down` (3,), metres in O.

    `atlas` is (left, upper, right, lower) in parts of the picture's width and height.
    """

    corner: Array
    right: Array
    down: Array
    atlas: tuple[float, float, float, float]

    @property
    def normal(self) -> Array:
        """Outward unit normal (3,)."""
        outward = np.cross(self.down, self.right)
        return np.asarray(outward / np.linalg.norm(outward))

    def points(self, across: Array, below: Array) -> Array:
        """Points (n, 3) at the parts `across` and `below` (n,) of the two edges."""
        return self.corner + across[:, None] * self.right + below[:, None] * self.down


def read_box(path: Path) -> tuple[Face, ...]:
    """The quads of an OBJ file. Raises ValueError where one is not a rectangle of the atlas."""
    vertices: list[list[float]] = []
    uvs: list[list[float]] = []
    faces: list[Face] = []
    for line in path.read_text(encoding="ascii").splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            vertices.append([float(word) for word in words])
        elif kind == "vt":
            uvs.append([float(word) for word in words])
        elif kind == "f":
            corners = [[int(number) - 1 for number in word.split("/")[:2]] for word in words]
            quad = {(uvs[t][0], uvs[t][1]): np.array(vertices[v]) for v, t in corners}
            faces.append(_face(path, quad))
    return tuple(faces)


def _face(path: Path, quad: dict[tuple[float, float], Array]) -> Face:
    left, right = min(u for u, _ in quad), max(u for u, _ in quad)
    lower, upper = min(v for _, v in quad), max(v for _, v in quad)
    try:
        corner = quad[left, upper]
        across, below = quad[right, upper] - corner, quad[left, lower] - corner
        opposite = quad[right, lower]
    except KeyError:
        raise ValueError(f"{path}: a face is not an upright rectangle of the atlas") from None
    if not np.allclose(corner + across + below, opposite, atol=1e-6):
        raise ValueError(f"{path}: a face is not a rectangle")
    return Face(corner, across, below, (left, 1 - upper, right, 1 - lower))
