"""Random places for boxes on the table, such that each can be seen, reached and grasped."""

from itertools import combinations
from math import cos, inf, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.operators.kinematics import reachable
from specc_runtime.plants.errors import PlantError

if TYPE_CHECKING:
    from specc_runtime.plants.mujoco import MujocoPlant

OBJECTS = ("herbapol_mint_tea", "mnich", "sen")
TABLE_HEIGHT_M = 0.906
# Of the centres of boxes, x and y in B; the hand at home hides what lies further left.
REGION_M = ((0.60, 0.85), (-0.43, -0.09))
GRASPABLE_M = (0.053, 0.085)
STEADIEST = 0.7  # least ratio of the shorter side of the lower face to the height
# Open fingers reach 0.032 m beyond the side of the slimmest box, and poses are not exact.
GAP_M = 0.045
GRASP_DEPTH_M = 0.045
LIFT_M = 0.20
SETTLING_S = 0.2
_HOME: Array = np.array([0.0, -pi / 2, 0.0, 0.0, 1.5 * pi, -pi / 2])
_ATTEMPTS = 2000


class PickingScene:
    """Boxes lying on random faces at random places in view and reach of the arm.

    The faces are those on which a box lies steadily and whose shorter side the fingers can span.
    Between any two boxes there is room for the open fingers.
    """

    gap_m = (GAP_M, inf)
    """Of the two nearest boxes, from and to."""

    def __init__(self, objects: tuple[str, ...] = OBJECTS) -> None:
        self.objects = objects

    def place(self, plant: "MujocoPlant", rng: np.random.Generator) -> None:
        """Put every object somewhere and let it come to rest. To be called after a reset.

        Raises:
            PlantError: no room was found, or the model lacks an object.
        """
        sizes = [plant.truth.box_size(name) for name in self.objects]
        for _ in range(_ATTEMPTS):
            poses = [random_pose(size, rng) for size in sizes]
            if self._apart(poses, sizes) and all(map(_within_reach, poses, sizes)):
                break
        else:
            raise PlantError(f"no room for {', '.join(self.objects)} on the table")
        for name, pose in zip(self.objects, poses, strict=True):
            plant.truth.move_body(name, pose)
        plant.settle(SETTLING_S)

    def _apart(self, poses: list[Array], sizes: list[Array]) -> bool:
        low, high = self.gap_m
        pairs = combinations(zip(poses, sizes, strict=True), 2)
        return low <= min((gap(*one, *other) for one, other in pairs), default=high) <= high


class CrowdedScene(PickingScene):
    """As a picking scene, with two boxes so near to each other that no finger fits between them."""

    gap_m = (0.01, 0.02)


def lying_faces(size: Array) -> tuple[tuple[int, int], ...]:
    """(axis, sign) pairs that may point up: steady on the table, spanned by the fingers."""
    found = []
    for axis in range(3):
        short = min(float(size[i]) for i in range(3) if i != axis)
        if GRASPABLE_M[0] <= short <= GRASPABLE_M[1] and short >= STEADIEST * size[axis]:
            found += [(axis, 1), (axis, -1)]
    return tuple(found)


def random_pose(size: Array, rng: np.random.Generator) -> Array:
    """X_BO (4, 4) of a box of that size on the table: face, place and turn are random."""
    faces = lying_faces(size)
    axis, sign = faces[rng.integers(len(faces))]
    X = np.eye(4)
    X[:3, :3] = _rotation_about_z(rng.uniform(-pi, pi)) @ _with_axis_up(axis, sign)
    X[:2, 3] = [rng.uniform(*bounds) for bounds in REGION_M]
    X[2, 3] = TABLE_HEIGHT_M + size[axis] / 2
    return X


def _with_axis_up(axis: int, sign: int) -> Array:
    """A rotation (3, 3) that turns sign * axis upwards; the next axis becomes x."""
    R = np.zeros((3, 3))
    R[2, axis] = sign
    R[0, (axis + 1) % 3] = 1.0
    R[1] = np.cross(R[2], R[0])
    return R


def _rotation_about_z(angle: float) -> Array:
    c, s = cos(angle), sin(angle)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


def _footprint(X: Array, size: Array) -> tuple[Array, Array, Array]:
    """Centre (2,), axes (2, 2) as rows and half sides (2,) of the rectangle under a lying box."""
    up = int(np.argmax(np.abs(X[2, :3])))
    flat = [axis for axis in range(3) if axis != up]
    return X[:2, 3], X[:2, flat].T, size[flat] / 2


def gap(X_1: Array, size_1: Array, X_2: Array, size_2: Array) -> float:
    """Lower bound of the distance of two lying boxes in the plane, m (separating axes)."""
    (c1, axes1, half1), (c2, axes2, half2) = _footprint(X_1, size_1), _footprint(X_2, size_2)
    axes = np.vstack((axes1, axes2))
    reach = np.abs(axes @ axes1.T) @ half1 + np.abs(axes @ axes2.T) @ half2
    return float(np.max(np.abs(axes @ (c2 - c1)) - reach))


def _within_reach(X: Array, size: Array) -> bool:
    """Whether the tool can grasp the box from above, one way round, and lift it straight up."""
    _, axes, half = _footprint(X, size)
    across = axes[int(np.argmin(half))]
    top = TABLE_HEIGHT_M + 2.0 * (X[2, 3] - TABLE_HEIGHT_M)
    return any(_can_lift(X[:2, 3], sign * across, top - GRASP_DEPTH_M) for sign in (1.0, -1.0))


def _can_lift(centre: Array, across: Array, height: float) -> bool:
    X_BE = np.eye(4)
    X_BE[:2, 1], X_BE[2, 2] = across, -1.0
    X_BE[2, 1] = X_BE[0, 2] = X_BE[1, 2] = 0.0
    X_BE[:3, 0] = np.cross(X_BE[:3, 1], X_BE[:3, 2])
    X_BE[:2, 3] = centre
    for lift in (0.0, LIFT_M):
        X_BE[2, 3] = height + lift
        if not reachable(X_BE, _HOME):
            return False
    return True
