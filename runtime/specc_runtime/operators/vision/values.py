"""The values that pass between the operators of the vision (eqs 33 and 35)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array

Image = NDArray[np.uint8]
Depth = NDArray[np.float32]
Descriptors = NDArray[np.float32]
Moves = tuple[Array, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """I^SIFT (eq. 44): `points` (n, 2) as (u, v) in pixels, whole numbers at pixel centres."""

    points: Array
    descriptors: Descriptors


@dataclass(frozen=True, eq=False)
class FeatureCloud:
    """C^SIFT in some frame: where each of n features is and from where it was seen.

    `points` (n, 3) in metres; `seen_from` (n, 3) are unit vectors: the outward normal of the
    surface for a feature of a model, the direction to the camera for one of a scene;
    `descriptors` (n, 128). Like those of a `Cloud`, both are computed when they are asked for, from
    what they were in the first frame.
    """

    first_points: Array
    first_seen_from: Array
    descriptors: Descriptors
    moves: Moves = ()

    @cached_property
    def points(self) -> Array:
        """(n, 3) m."""
        return _moved(self.first_points, self.moves, move_points)

    @cached_property
    def seen_from(self) -> Array:
        """(n, 3) unit vectors."""
        return _moved(self.first_seen_from, self.moves, _turned)

    def moved(self, X_AB: Array) -> FeatureCloud:
        """The cloud, which is known in B, in A."""
        return replace(self, moves=(*self.moves, X_AB))


@dataclass(frozen=True, eq=False)
class Cloud:
    """C^RGB in some frame: `points` (n, 3) in metres with `colours` (n, 3) RGB.

    A cloud that is moved from frame to frame shares `first_points`, those in the first one;
    `moves` are poses (4, 4) of each frame in the next.
    """

    first_points: Array
    colours: Image
    moves: Moves = ()

    @cached_property
    def points(self) -> Array:
        """(n, 3) m."""
        return _moved(self.first_points, self.moves, move_points)

    def moved(self, X_AB: Array) -> Cloud:
        """The cloud, which is known in B, in A."""
        return replace(self, moves=(*self.moves, X_AB))


def move_points(X_AB: Array, points: Array) -> Array:
    """Points of B (n, 3) in A, for X_AB (4, 4)."""
    moved: Array = points @ X_AB[:3, :3].T + X_AB[:3, 3]
    return moved


def _turned(X_AB: Array, directions: Array) -> Array:
    turned: Array = directions @ X_AB[:3, :3].T
    return turned


def _moved(vectors: Array, moves: Moves, move: Callable[[Array, Array], Array]) -> Array:
    """Points or directions (n, 3) after all moves, read-only."""
    for X in moves:
        vectors = move(X, vectors)
    vectors.setflags(write=False)
    return vectors


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class ObjectModel:
    """A model (eq. 33), its clouds in O: the centre of the box, axes along its sides.

    `label` is the paper's id of the model, `size` (3,) the sides of the box in metres.
    """

    label: str
    C_rgb: Cloud
    C_sift: FeatureCloud
    size: Array


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """N matches (eq. 46), each (N,): scene feature, number of the model, feature of that model."""

    scene: NDArray[np.int64]
    model: NDArray[np.int64]
    feature: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class PoseHypothesis:
    """A pose (eq. 48): model number `model` at X_KO (4, 4), from a cluster of `support` matches."""

    model: int
    X_KO: Array
    support: int


@dataclass(frozen=True, slots=True, eq=False)
class Object:
    """A recognised object (eq. 35), all of it in one frame F, first K, later B.

    `X` (4, 4) is the pose of O in F; the clouds are the model's, moved there. `confidence` is the
    number of matches over the number of features of the model. `label` is the model's label and
    the number of the object, see `label_of`. `size` (3,) are the sides of the box in metres.
    """

    C_rgb: Cloud
    C_sift: FeatureCloud
    X: Array
    confidence: float
    label: str
    size: Array


def label_of(model_label: str, number: int) -> str:
    """The label of an object: the model's label and a consecutive number (text after eq. 35)."""
    return f"{model_label}_{number}"


def model_label_of(label: str) -> str:
    """The model's label in the label of an object, as US needs it (text before eq. 64)."""
    return label.rpartition("_")[0]
