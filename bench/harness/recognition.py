"""How far recognition reaches: eqs 44 to 50 on pictures of the flagship's Kinect, by ray casting.

One box at a time lies, leans or is half hidden below the camera, at poses that are known.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import acos, cos, degrees, pi, radians, sin
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from specc_runtime.cells.irp6_picking.scene import OBJECTS, TABLE_HEIGHT_M, random_pose
from specc_runtime.operators.vision.camera import kinect_intrinsics
from specc_runtime.operators.vision.features import extract_features, to_cartesian
from specc_runtime.operators.vision.grouping import group_correspondences
from specc_runtime.operators.vision.hypotheses import project_hypotheses
from specc_runtime.operators.vision.matching import match_features
from specc_runtime.operators.vision.models import load_models
from specc_runtime.operators.vision.values import model_label_of
from specc_runtime.operators.vision.verification import verify_hypotheses
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.plants.mujoco import MujocoPlant

SPECS = Path(__file__).resolve().parents[2] / "specs"
MODEL = SPECS / "plants" / "irp6_picking.xml"
KINECT = (
    SensorBinding("rgb", camera="kinect"),
    SensorBinding("depth", camera="kinect", image="depth", depth_noise="kinect"),
)
_BEAM = re.compile(r'<geom type="capsule" fromto="0.898[^>]*/>')  # what the camera hangs from
_CAMERA = re.compile(r'(<body name="kinect" pos=")([^"]+)"')
_PLATE = (
    '<body name="plate" pos="9 9 0.1"><freejoint/>'
    '<geom type="box" size="0.2 0.2 0.001" mass="1" rgba="0.2 0.2 0.2 1"/></body></worldbody>'
)
P_B_M = np.array((0.695, -0.262))  # where the camera's axis meets the table
AWAY_M = 9.0
GOOD_MM, GOOD_DEG = 10.0, 5.0
"""A pose this near is right; others are of nothing that is there."""
POSES = 5
"""Of each of the three boxes, at each point."""
POINTS = {
    "distance [m]": (0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0),
    "tilt [deg]": (0.0, 15.0, 30.0, 45.0, 60.0, 75.0),
    "hidden": (0.0, 0.15, 0.3, 0.45, 0.6, 0.75),
}
"""Distance of the camera from the box, tilt of the box, share of its upper face that is hidden."""

Row = dict[str, Any]


def trials() -> Iterator[Row]:
    """A row for each picture: what was varied, whether the box was found, and how well."""
    models, P = load_models(str(SPECS / "objects")), kinect_intrinsics()
    for what, values in POINTS.items():
        for value in values:
            with TemporaryDirectory() as folder:
                plant = _plant(Path(folder), value if what == "distance [m]" else None)
                for number, name in enumerate(OBJECTS):
                    for seed in range(POSES):
                        X_BO = _set(plant, what, value, name, 100 * number + seed)
                        rgb, depth = (plant.sample(s.name).value() for s in KINECT)
                        C_sift = to_cartesian(extract_features(rgb), depth, P)
                        M = match_features(C_sift, models)
                        T = group_correspondences(M, C_sift, models)
                        found = verify_hypotheses(project_hypotheses(T, models), depth, P)
                        shown = _judged(found, name, np.linalg.inv(_camera(plant)) @ X_BO)
                        yield {"varied": what, "value": value, "object": name, **shown}
                plant.close()


def _plant(folder: Path, distance_m: float | None) -> MujocoPlant:
    """The flagship's plant with a plate, and the camera so far from the table."""
    text = MODEL.read_text(encoding="utf-8").replace("</worldbody>", _PLATE)
    text = text.replace('"../objects"', f'"{SPECS / "objects"}"')
    text = _BEAM.sub("", text)
    path = folder / "model.xml"
    path.write_text(text, encoding="utf-8")
    plant = MujocoPlant(str(path), KINECT, renderer="raycast")
    if distance_m is not None:
        # As far along its own axis as the distance has changed.
        X = _camera(plant)
        on_table = np.array((*P_B_M, TABLE_HEIGHT_M))
        moved = on_table - X[:3, 2] * distance_m
        text = _CAMERA.sub(rf'\g<1>{" ".join(map(repr, map(float, moved)))}"', text)
        path.write_text(text, encoding="utf-8")
        plant.close()
        plant = MujocoPlant(str(path), KINECT, renderer="raycast")
    return plant


def _camera(plant: MujocoPlant) -> Any:
    """X_BK (4, 4), the optical frame: x to the right, y down, z forward."""
    X = plant.truth.body_pose("kinect")
    X[:3, 1:3] *= -1
    return X


def _set(plant: MujocoPlant, what: str, value: float, name: str, seed: int) -> Any:
    """Put one box below the camera, and the others away; its pose X_BO (4, 4)."""
    rng = np.random.default_rng(seed)
    plant.reset(seed)
    for number, other in enumerate((*OBJECTS, "plate")):
        far = np.eye(4)
        far[:3, 3] = (AWAY_M, AWAY_M + number, 1.0)
        plant.truth.move_body(other, far)
    X = random_pose(plant.truth.box_size(name), rng)
    X[:2, 3] = P_B_M
    if what == "tilt [deg]":
        axis = rng.uniform(-pi, pi)
        X[:3, :3] = _turned(np.array((cos(axis), sin(axis), 0.0)), radians(value)) @ X[:3, :3]
        X[2, 3] = TABLE_HEIGHT_M + 0.15  # above the table, whatever corner is lowest
    plant.truth.move_body(name, X)
    if what == "hidden" and value > 0.0:
        plant.truth.move_body("plate", _over(X, plant.truth.box_size(name), value))
    return X


def _over(X_BO: Any, size: Any, share: float) -> Any:
    """Where the plate hides a share of the upper face, from one of its shorter sides on."""
    up = int(np.argmax(np.abs(X_BO[2, :3])))
    along = max((axis for axis in range(3) if axis != up), key=lambda axis: float(size[axis]))
    X = np.eye(4)
    X[:3, 0] = X_BO[:3, along]
    X[:3, 1] = np.cross((0.0, 0.0, 1.0), X[:3, 0])
    edge = size[along] * (share - 0.5)
    X[:3, 3] = X_BO[:3, 3] + X_BO[:3, along] * (edge - 0.2)
    X[2, 3] += size[up] / 2 + 0.004
    return X


def _turned(axis: Any, angle: float) -> Any:
    """The rotation (3, 3) by an angle about a unit vector (Rodrigues)."""
    x, y, z = axis
    K = np.array(((0, -z, y), (z, 0, -x), (-y, x, 0)))
    return np.eye(3) + sin(angle) * K + (1 - cos(angle)) * K @ K


def _judged(found: Any, name: str, X_KO: Any) -> Row:
    """Whether the box is among what was found, how well, and what is there that should not be."""
    errors = [
        (_apart(each.X, X_KO) if model_label_of(each.label) == name else (1e9, 1e9))
        for each in found
    ]
    right = [e for e in errors if e[0] <= GOOD_MM and e[1] <= GOOD_DEG]
    best = min(right, default=(None, None))
    return {
        "found": bool(right),
        "position_error_mm": best[0],
        "rotation_error_deg": best[1],
        "false": len(errors) - len(right),
    }


def _apart(X_1: Any, X_2: Any) -> tuple[float, float]:
    """Distance in mm and angle in degrees of two poses."""
    cosine = (float(np.trace(X_1[:3, :3].T @ X_2[:3, :3])) - 1.0) / 2.0
    away_mm = 1e3 * float(np.linalg.norm(X_1[:3, 3] - X_2[:3, 3]))
    return away_mm, degrees(acos(min(1.0, max(-1.0, cosine))))
