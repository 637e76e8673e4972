"""A Kinect over a table with textured boxes, by ray casting: the oracle of the vision tests.

It shares nothing with the operators: it finds the texture of a point by the affine map that the
mesh's vertices define, and looks pixels up in the atlas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from specc_runtime.operators.vision.models import load_models

OBJECTS = Path(__file__).parents[2] / "specs" / "objects"
NAMES = ("herbapol_mint_tea", "mnich", "sen")

WIDTH, HEIGHT, FOCAL, CX, CY = 640, 480, 525.0, 319.5, 239.5
TABLE_Z = 0.906
SAMPLES = (np.arange(3) - 1) / 3
MODELS = load_models(str(OBJECTS))


def _camera_pose() -> np.ndarray:
    """X_BK from the published origin and directions of the x and z axes of the optical frame."""
    z = np.array([-0.16549, -0.04335, -0.98526])
    z /= np.linalg.norm(z)
    x = np.array([0.00396, -0.99905, 0.04329])
    x -= (x @ z) * z
    x /= np.linalg.norm(x)
    X_BK = np.eye(4)
    X_BK[:3] = np.column_stack([x, np.cross(z, x), z, (0.88317, -0.21239, 2.0291)])
    return X_BK


X_BK = _camera_pose()

# Which way up a box lies: rotations that bring each of its axes, forth and back, upwards.
LYING = tuple(
    np.array(rows, float).T
    for rows in (
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
        ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
        ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
        ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
        ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    )
)


@dataclass(frozen=True)
class Box:
    """A box at X_BO; `uv` (6, 2, 4) maps a point (x, y, z, 1) of each face to the atlas."""

    name: str
    X_BO: np.ndarray
    size: np.ndarray
    atlas: np.ndarray
    uv: np.ndarray


def box(name: str, X_BO: np.ndarray) -> Box:
    vertices, uvs, normals = [], [], []
    for line in (OBJECTS / f"{name}.obj").read_text().splitlines():
        kind, *words = line.split()
        if kind in ("v", "vt", "vn"):
            {"v": vertices, "vt": uvs, "vn": normals}[kind].append([float(w) for w in words])
    corners = np.c_[np.array(vertices), np.ones(24)].reshape(6, 4, 4)
    places = np.array(uvs).reshape(6, 4, 2)
    maps = np.empty((6, 2, 4))
    for normal, four, uv in zip(normals, corners, places, strict=True):
        axis = int(np.argmax(np.abs(normal)))
        side = 2 * axis + (sum(normal) < 0)
        maps[side] = np.linalg.lstsq(four, uv, rcond=None)[0].T
    return Box(name, X_BO, np.ptp(np.array(vertices), axis=0), atlas(name), maps)


@cache
def atlas(name: str) -> np.ndarray:
    return cv2.imread(str(OBJECTS / f"{name}.png"))[..., ::-1].astype(np.float64)


def lying_box(name: str, side: int, x: float, y: float, yaw: float) -> Box:
    """A box on the table with one of its six sides down."""
    c, s = np.cos(yaw), np.sin(yaw)
    X_BO = np.eye(4)
    X_BO[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ LYING[side]
    made = box(name, X_BO)
    height = np.abs(X_BO[2, :3]) @ made.size
    X_BO[:3, 3] = (x, y, TABLE_Z + height / 2)
    return made


def random_boxes(rng: np.random.Generator) -> tuple[Box, ...]:
    """The three objects anyhow on the table, apart from each other."""
    while True:
        places = rng.uniform((0.5, -0.5), (0.9, 0.0), (3, 2))
        gaps = [np.hypot(*(places[i] - places[j])) for i, j in ((0, 1), (0, 2), (1, 2))]
        if min(gaps) > 0.17:
            break
    return tuple(
        lying_box(name, int(rng.integers(6)), *place, rng.uniform(-np.pi, np.pi))
        for name, place in zip(NAMES, places, strict=True)
    )


def render(boxes: tuple[Box, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Exact picture (h, w, 3) uint8 RGB and depth (h, w) float32, in metres, of the scene."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    down = X_BK[2, 0] * (u - CX) / FOCAL + X_BK[2, 1] * (v - CY) / FOCAL + X_BK[2, 2]
    depth = (TABLE_Z - X_BK[2, 3]) / down
    rgb = np.dstack([150 + 0.05 * u, 145 + 0.06 * v, 140 + 0.02 * (u + v)])
    nearest = np.repeat(depth[..., None], 9, axis=2)
    samples = np.repeat(rgb[:, :, None], 9, axis=2)
    for each in boxes:
        _paint(each, samples, nearest)
    return np.round(samples.mean(axis=2)).astype(np.uint8), nearest[..., 4].astype(np.float32)


def _paint(target: Box, samples: np.ndarray, nearest: np.ndarray) -> None:
    X_KO = np.linalg.inv(X_BK) @ target.X_BO
    half = target.size / 2
    corners = np.array(np.meshgrid(*[(-h, h) for h in half])).reshape(3, 8).T
    seen = corners @ X_KO[:3, :3].T + X_KO[:3, 3]
    us, vs = seen[:, 0] / seen[:, 2] * FOCAL + CX, seen[:, 1] / seen[:, 2] * FOCAL + CY
    columns = np.arange(max(0, int(us.min()) - 1), min(WIDTH, int(us.max()) + 3))
    rows = np.arange(max(0, int(vs.min()) - 1), min(HEIGHT, int(vs.max()) + 3))
    if not (len(columns) and len(rows)):
        return
    dv, du = np.meshgrid(SAMPLES, SAMPLES, indexing="ij")
    u = columns[None, :, None] + du.ravel() + 0 * rows[:, None, None]
    v = rows[:, None, None] + dv.ravel() + 0 * columns[None, :, None]
    ray = np.stack([(u - CX) / FOCAL, (v - CY) / FOCAL, np.ones_like(u)], axis=-1)
    direction = ray @ X_KO[:3, :3]
    eye = -X_KO[:3, :3].T @ X_KO[:3, 3]
    with np.errstate(divide="ignore"):
        near = (-np.sign(direction) * half - eye) / direction
        far = (np.sign(direction) * half - eye) / direction
    axis = near.argmax(axis=-1)
    z = near.max(axis=-1)
    window = np.ix_(rows, columns)
    hit = (z < far.min(axis=-1)) & (z < nearest[window])
    point = eye + z[..., None] * direction
    side = 2 * axis + (np.take_along_axis(direction, axis[..., None], -1)[..., 0] > 0)
    uv = np.einsum("nij,nj->ni", target.uv[side[hit]], np.c_[point[hit], np.ones(hit.sum())])
    light = np.array([0.93, 0.9, 0.97, 0.86, 1.0, 0.83])[side[hit]]
    height, width = target.atlas.shape[:2]
    column = np.clip(uv[:, 0] * width, 0, width - 1).astype(int)
    row = np.clip((1 - uv[:, 1]) * height, 0, height - 1).astype(int)
    painted, depths = samples[window], nearest[window]
    painted[hit] = target.atlas[row, column] * light[:, None]
    depths[hit] = z[hit]
    samples[window], nearest[window] = painted, depths


def with_noise(
    rgb: np.ndarray, depth: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """The noise of a Kinect: sigma 1.425e-3 z^2 and steps of 2.7e-3 z^2 metres; grey noise 1.5."""
    noisy = depth + 1.425e-3 * depth**2 * rng.standard_normal(depth.shape)
    step = 2.7e-3 * depth**2
    grain = rng.normal(0, 1.5, rgb.shape)
    quantised = (np.round(noisy / step) * step).astype(np.float32)
    return np.clip(rgb + grain, 0, 255).astype(np.uint8), quantised


def pose_error(X_a: np.ndarray, X_b: np.ndarray) -> tuple[float, float]:
    """Distance in metres and angle in radians between two poses."""
    cosine = (np.trace(X_a[:3, :3].T @ X_b[:3, :3]) - 1) / 2
    return float(np.linalg.norm(X_a[:3, 3] - X_b[:3, 3])), float(np.arccos(np.clip(cosine, -1, 1)))
