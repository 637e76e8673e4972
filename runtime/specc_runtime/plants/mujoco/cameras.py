"""Cameras of a model: their geometry, the choice of what draws their images, and where."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from copy import copy
from math import radians, tan
from threading import Lock
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.model import find
from specc_runtime.plants.mujoco.view import Camera, Frame, Renderer, Shot
from specc_runtime.workers import Workers

RendererName = Literal["auto", "gl", "raycast"]
_DEFAULT_SIZE = (640, 480)
T = TypeVar("T")


class Cameras:
    """Shots of the plant and their frames, each drawn at most once.

    OpenGL is bound to a thread. So one thread opens the renderer when it is first needed, draws for
    all the others, and closes it.
    """

    def __init__(self, model: Any, data: Any, renderer: RendererName) -> None:
        if renderer not in ("auto", "gl", "raycast"):
            raise PlantError(f"no renderer '{renderer}'", known=("auto", "gl", "raycast"))
        self._model = model
        self._data = data
        self._wanted = renderer
        self._renderer: Renderer | None = None
        self._thread: Workers | None = None
        self._lock = Lock()
        self._shot: Shot | None = None

    def camera(self, name: str, width: int = 0, height: int = 0) -> Camera:
        """The camera of that name, at its own resolution or at another size in pixels.

        Raises:
            PlantError: there is none.
        """
        return _camera(self._model, find(self._model, "camera", name), width, height)

    def open(self) -> None:
        """Begin to open the renderer, in its thread; what fails is told when it is used."""
        with self._lock:
            self._submit(self._opened)

    def shot(self) -> Shot:
        """The present state, from which frames can be drawn at any time after."""
        if self._shot is None or self._shot.state.time != self._data.time:
            self._shot = Shot(copy(self._data))
        return self._shot

    def frame(self, camera: Camera, shot: Shot) -> Future[Frame]:
        """What a camera sees in a shot, once it is drawn."""
        with self._lock:
            if camera not in shot.frames:
                shot.frames[camera] = self._submit(
                    lambda: self._opened().render(camera, shot.state)
                )
            return shot.frames[camera]

    def picture(self, camera: Camera, groups: Sequence[int] | None = None) -> NDArray[np.uint8]:
        """What a camera for people sees now; waits until it is drawn."""
        with self._lock:
            drawn = self._submit(lambda: self._opened().picture(camera, self._data, groups))
        return drawn.result()

    def picture_of_now(self, camera: Camera) -> Future[NDArray[np.uint8]]:
        """What a camera for people sees in the present state, once it is drawn."""
        state = copy(self._data)
        with self._lock:
            return self._submit(lambda: self._opened().picture(camera, state))

    def forget(self) -> None:
        """Take a new shot: the state has changed without time passing."""
        self._shot = None

    def close(self) -> None:
        """Close the renderer."""
        with self._lock:
            if self._thread is None:
                return
            closed = self._submit(self._close)
            self._thread.close()
            self._thread = None
        closed.result()

    def _submit(self, call: Callable[[], T]) -> Future[T]:
        """Have it called by the thread that draws; the lock is held."""
        if self._thread is None:
            self._thread = Workers(1, "specc-camera")
        return self._thread.submit(call)

    def _opened(self) -> Renderer:
        if self._renderer is None:
            self._renderer = _open(self._model, self._wanted)
        return self._renderer

    def _close(self) -> None:
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


def _camera(model: Any, index: int, width: int, height: int) -> Camera:
    """Intrinsics from the model, scaled to the wanted height."""
    own_width, own_height = (int(v) for v in model.cam_resolution[index])
    if own_width <= 1 or own_height <= 1:
        own_width, own_height = _DEFAULT_SIZE
    width, height = width or own_width, height or own_height
    sensor = model.cam_sensorsize[index]
    if sensor[0] > 0 and sensor[1] > 0:
        focal_x, focal_y, offset_x, offset_y = (float(v) for v in model.cam_intrinsic[index])
        fx, fy = focal_x / sensor[0] * width, focal_y / sensor[1] * height
        # MuJoCo moves the frustum by these offsets, so the image moves the other way.
        right, down = -offset_x / sensor[0] * width, -offset_y / sensor[1] * height
    else:
        fx = fy = height / 2 / tan(radians(float(model.cam_fovy[index])) / 2)
        right = down = 0.0
    centre = (width - 1) / 2 + right, (height - 1) / 2 + down
    return Camera(index, width, height, float(fx), float(fy), float(centre[0]), float(centre[1]))


def _open(model: Any, wanted: RendererName) -> Renderer:
    if wanted != "raycast":
        from specc_runtime.plants.mujoco.gl import GlRenderer, GlUnavailableError

        try:
            return GlRenderer(model)
        except GlUnavailableError as error:
            if wanted == "gl":
                raise PlantError(f"no OpenGL: {error}") from error
    from specc_runtime.plants.mujoco.raycast import RaycastRenderer

    return RaycastRenderer(model)
