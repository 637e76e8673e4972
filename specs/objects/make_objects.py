"""Make NAME.png (texture atlas) and NAME.obj (box with that texture) for every object.

Usage: python make_objects.py [DIRECTORY]. The same OpenCV and numpy give the same bytes.
The meshes are in metres with their origin in the centre of the box. A face's picture is upright
when z points up (when y points up on the faces +z and -z).
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from drawing import Design, Image, draw_face, save_png

PX_PER_MM = 2.5
GUTTER_PX = 8

# Outward normal, then the face's directions right and down in the frame of the object.
FACES = (
    ((1, 0, 0), (0, 1, 0), (0, 0, -1)),
    ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
    ((0, 1, 0), (-1, 0, 0), (0, 0, -1)),
    ((0, -1, 0), (1, 0, 0), (0, 0, -1)),
    ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
    ((0, 0, -1), (-1, 0, 0), (0, -1, 0)),
)

DESIGNS = {
    "herbapol_mint_tea": Design(
        seed=11,
        palette=((16, 62, 32), (38, 120, 52), (120, 190, 70), (214, 232, 140), (250, 250, 236)),
        titles=("FRESH", "HERBS", "GREEN LEAF", "TEA GARDEN", "MINT TEA", "PEPPERMINT"),
        words=("20 bags", "30 g", "infuse", "5 min", "no dyes", "field", "leaf", "cool", "cup"),
        motifs=("leaf", "leaf", "blob", "star", "shard"),
    ),
    "mnich": Design(
        seed=23,
        palette=((44, 20, 10), (130, 36, 24), (196, 110, 34), (240, 200, 96), (255, 246, 220)),
        titles=("MONK", "ABBEY", "OLD CELLAR", "BLACK TEA", "MNICH", "CLOISTER"),
        words=("50 bags", "100 g", "strong", "brew", "amber", "spice", "since", "press", "malt"),
        motifs=("shard", "shard", "star", "blob", "crescent"),
    ),
    "sen": Design(
        seed=37,
        palette=((12, 16, 58), (44, 60, 140), (128, 96, 190), (170, 200, 240), (252, 250, 255)),
        titles=("NIGHT", "QUIET", "DREAM", "MOON", "SEN", "SLEEP"),
        words=("25 bags", "40 g", "balm", "hops", "calm", "rest", "evening", "warm", "soft"),
        motifs=("crescent", "crescent", "star", "blob", "leaf"),
    ),
}


@dataclass(frozen=True)
class Placed:
    """A face's picture and the corner of the atlas (u, v) in pixels at which it is put."""

    picture: Image
    u: int
    v: int


def main(directory: Path) -> None:
    """Write the pictures and meshes of all objects in DIRECTORY/objects.json."""
    for name, entry in json.loads((directory / "objects.json").read_text()).items():
        size_m = np.array(entry["size_m"])
        placed = place_faces(draw_faces(DESIGNS[name], size_m))
        atlas = paint_atlas(placed)
        save_png(directory / f"{name}.png", atlas)
        (directory / f"{name}.obj").write_text(mesh_text(name, size_m, placed, atlas))


def draw_faces(design: Design, size_m: np.ndarray) -> list[Image]:
    """The six pictures in the order of FACES."""
    pictures = []
    for index, (_, right, down) in enumerate(FACES):
        width_mm, height_mm = (1e3 * float(np.abs(side) @ size_m) for side in (right, down))
        pictures.append(draw_face(design, index, (width_mm, height_mm), PX_PER_MM))
    return pictures


def place_faces(pictures: list[Image]) -> list[Placed]:
    """Two faces a row, opposite faces side by side, gutters around each."""
    placed: list[Placed] = []
    v = GUTTER_PX
    for left, right in zip(pictures[0::2], pictures[1::2], strict=True):
        placed.append(Placed(left, GUTTER_PX, v))
        placed.append(Placed(right, 3 * GUTTER_PX + left.shape[1], v))
        v += left.shape[0] + 2 * GUTTER_PX
    return placed


def paint_atlas(placed: list[Placed]) -> Image:
    """The atlas. Edges are repeated into the gutters, so that no mipmap mixes two faces there."""
    height = max(face.v + face.picture.shape[0] for face in placed) + GUTTER_PX
    width = max(face.u + face.picture.shape[1] for face in placed) + GUTTER_PX
    atlas = np.full((height, width, 3), 128, np.uint8)
    for face in placed:
        around = ((GUTTER_PX, GUTTER_PX), (GUTTER_PX, GUTTER_PX), (0, 0))
        padded = np.pad(face.picture, around, mode="edge")
        u, v = face.u - GUTTER_PX, face.v - GUTTER_PX
        atlas[v : v + padded.shape[0], u : u + padded.shape[1]] = padded
    return atlas


def mesh_text(name: str, size_m: np.ndarray, placed: list[Placed], atlas: Image) -> str:
    """Wavefront OBJ: six quads, four vertices each, seen anticlockwise from outside."""
    height, width = atlas.shape[:2]
    lines = [f"# {name}: box {' x '.join(f'{side:g}' for side in size_m)} m, origin in its centre"]
    faces = []
    for index, ((normal, right, down), face) in enumerate(zip(FACES, placed, strict=True)):
        rows, columns = face.picture.shape[:2]
        for along, below in ((-1, 1), (1, 1), (1, -1), (-1, -1)):
            corner = (np.array(normal) + along * np.array(right) + below * np.array(down)) / 2
            lines.append("v {:.6g} {:.6g} {:.6g}".format(*(corner * size_m)))
            u = (face.u + columns * (along > 0)) / width
            v = 1 - (face.v + rows * (below > 0)) / height
            lines.append(f"vt {u:.8f} {v:.8f}")
        lines.append("vn {} {} {}".format(*normal))
        first = 4 * index
        faces.append("f " + " ".join(f"{first + k}/{first + k}/{index + 1}" for k in range(1, 5)))
    return "\n".join(lines + faces) + "\n"


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
