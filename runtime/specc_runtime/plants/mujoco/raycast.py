"""Camera images without a graphics system: MuJoCo's ray casting and a texture lookup."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.surface import Hits, Surfaces
from specc_runtime.plants.mujoco.view import Camera, Frame

_VISIBLE = np.array((1, 1, 1, 0, 0, 0), np.uint8)  # geom groups, as drawn by default
_SHOWN_GROUPS = 3
_FAR_M = 1e6
_NEAREST_M = 1e-3
_BACKGROUND = np.uint8(235)
_CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


@dataclass(frozen=True, slots=True)
class _View:
    """A camera in the world: origin (3,), axes X_WC (columns right, up, backward), rays (n, 3)."""

    camera: Camera
    origin: Array
    axes: Array
    rays: Array


class RaycastRenderer:
    """Draws like `gl.GlRenderer` does for sensors, but without highlights and smoothed edges.

    What cannot move is cast once for a camera that cannot move; later frames cast only the pixels
    where moving geoms can be, and only against those.
    """

    def __init__(self, model: Any) -> None:
        self._model = model
        self._surfaces = Surfaces(model)
        fixed = model.body_weldid[model.geom_bodyid] == 0
        self._moving = np.flatnonzero(~fixed & (model.geom_group < _SHOWN_GROUPS))
        self._scenery = copy(model)
        self._scenery.geom_group[self._moving] = _SHOWN_GROUPS  # out of sight
        self._still: dict[Camera, tuple[_View, Frame]] = {}

    def render(self, camera: Camera, state: Any) -> Frame:
        """See `view.Renderer`."""
        if not self._stands_still(camera):
            view = _view(camera, state)
            return self._cast(self._model, state, view, _all(view), _empty(camera))
        if camera not in self._still:
            view = _view(camera, state)
            still = self._cast(self._scenery, state, view, _all(view), _empty(camera))
            self._still[camera] = view, still
        view, still = self._still[camera]
        pixels = self._pixels_of_moving(view, state)
        return self._cast(self._model, state, view, pixels, still, static=False)

    def picture(
        self, camera: Camera, state: Any, groups: Sequence[int] | None = None
    ) -> NDArray[np.uint8]:
        """See `view.Renderer`."""
        if groups is None:
            return self.render(camera, state).rgb
        view, shown = _view(camera, state), np.array([g in groups for g in range(6)], np.uint8)
        pixels, empty = _all(view), _empty(camera)
        return self._cast(self._model, state, view, pixels, empty, visible=shown).rgb

    def close(self) -> None:
        """See `view.Renderer`."""
        self._still.clear()

    def _stands_still(self, camera: Camera) -> bool:
        """Whether camera and lights hang on the world and follow nothing."""
        model = self._model
        fixed = mujoco.mjtCamLight.mjCAMLIGHT_FIXED.value
        on_world = model.body_weldid[model.cam_bodyid[camera.index]] == 0
        lit_from_world = (model.body_weldid[model.light_bodyid] == 0).all()
        still = model.cam_mode[camera.index] == fixed and (model.light_mode == fixed).all()
        return bool(on_world and lit_from_world and still)

    def _cast(
        self,
        model: Any,
        state: Any,
        view: _View,
        pixels: NDArray[np.intp],
        behind: Frame,
        *,
        static: bool = True,
        visible: NDArray[np.uint8] = _VISIBLE,
    ) -> Frame:
        """Frame of what the rays of some pixels hit, in front of another frame."""
        rays = view.rays[pixels]
        geom = np.empty(len(rays), np.int32)
        depth, normal = np.empty(len(rays)), np.empty((len(rays), 3))
        mujoco.mj_multiRay(
            model, state, view.origin, rays.ravel(), visible, static, -1,
            geom, depth, normal.ravel(), len(rays), _FAR_M,
        )  # fmt: skip
        far = behind.depth.ravel()[pixels]
        nearer = np.flatnonzero((depth >= 0) & ((far == 0) | (depth < far)))
        step = np.stack((view.axes[:, 0] / view.camera.fx, -view.axes[:, 1] / view.camera.fy))
        hits = Hits(geom[nearer], depth[nearer], normal[nearer], rays[nearer], view.origin, step)
        frame = Frame(behind.rgb.copy(), behind.depth.copy())
        drawn = pixels[nearer]
        frame.rgb.reshape(-1, 3)[drawn] = self._surfaces.shade(state, hits, -view.axes[:, 2])
        frame.depth.ravel()[drawn] = hits.depth
        return frame

    def _pixels_of_moving(self, view: _View, state: Any) -> NDArray[np.intp]:
        """Indices of the pixels inside the projected bounding boxes of geoms that can move."""
        camera = view.camera
        mask = np.zeros((camera.height, camera.width), bool)
        for left, top, right, bottom in self._rectangles(view, state):
            mask[top:bottom, left:right] = True
        return np.flatnonzero(mask)

    def _rectangles(self, view: _View, state: Any) -> NDArray[np.intp]:
        """Rows (left, top, right, bottom), in pixels, that contain each moving geom."""
        boxes = self._model.geom_aabb[self._moving]
        corners = boxes[:, None, :3] + _CORNERS * boxes[:, None, 3:]
        rotation = state.geom_xmat[self._moving].reshape(-1, 3, 3)
        world = np.einsum("gij,gkj->gki", rotation, corners)
        world += state.geom_xpos[self._moving][:, None]
        right, up, backward = np.moveaxis((world - view.origin) @ view.axes, -1, 0)
        camera, depth = view.camera, np.maximum(-backward, _NEAREST_M)
        u, v = camera.cx + camera.fx * right / depth, camera.cy - camera.fy * up / depth
        size = np.array((camera.width, camera.height))
        low = np.stack((u.min(axis=1), v.min(axis=1)), axis=1)
        high = np.stack((u.max(axis=1), v.max(axis=1)), axis=1)
        # A box that reaches behind the camera has no rectangle: it may be anywhere.
        around = (backward > -_NEAREST_M).any(axis=1, keepdims=True)
        low = np.where(around, 0, np.clip(np.floor(low), 0, size))
        high = np.where(around, size, np.clip(np.ceil(high) + 1, 0, size))
        hidden = (backward > -_NEAREST_M).all(axis=1)
        rectangles: NDArray[np.intp] = np.hstack((low, high))[~hidden].astype(np.intp)
        return rectangles


def _view(camera: Camera, state: Any) -> _View:
    axes = np.array(state.cam_xmat[camera.index]).reshape(3, 3)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    right, up = (u - camera.cx) / camera.fx, (camera.cy - v) / camera.fy
    rays = np.stack((right, up, -np.ones_like(right)), axis=-1).reshape(-1, 3)
    origin = np.array(state.cam_xpos[camera.index])
    return _View(camera, origin, axes, np.ascontiguousarray(rays @ axes.T))


def _all(view: _View) -> NDArray[np.intp]:
    return np.arange(len(view.rays))


def _empty(camera: Camera) -> Frame:
    size = camera.height, camera.width
    return Frame(np.full((*size, 3), _BACKGROUND), np.zeros(size, np.float32))
