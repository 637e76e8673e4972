"""What a camera is and what it sees; renderers and those who use them meet here."""

from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera; a pixel's coordinates (u, v) are integers in its centre.

    A point (X, Y, Z) of the optical frame (x right, y down, z forward, metres) appears at
    u = fx X / Z + cx, v = fy Y / Z + cy.
    """

    index: int
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True)
class Frame:
    """What a camera sees: rgb (h, w, 3) uint8; depth (h, w) float32, metres, 0 = no reading."""

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """The plant at one instant: a copy of its state, an MjData, and the frames drawn of it."""

    state: Any
    frames: dict[Camera, Future[Frame]] = field(default_factory=dict)


class Renderer(Protocol):
    """Draws what cameras see in a state of the plant, an MjData. Made and used in one thread."""

    def render(self, camera: Camera, state: Any) -> Frame:
        """Image and depth without decoration, as a sensor sees them."""

    def picture(
        self, camera: Camera, state: Any, groups: Sequence[int] | None = None
    ) -> NDArray[np.uint8]:
        """(h, w, 3) image for people, of the geoms of these groups, by default those below 3."""

    def close(self) -> None:
        """Free what was taken from the graphics system."""
