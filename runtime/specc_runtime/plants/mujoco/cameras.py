"""Cameras of a model: their geometry, and the choice of what draws their images."""

from math import radians, tan
from typing import Any, Literal

from specc_runtime.plants.errors import PlantError
from specc_runtime.plants.mujoco.model import find
from specc_runtime.plants.mujoco.view import Camera, Frame, Renderer

RendererName = Literal["auto", "gl", "raycast"]
_DEFAULT_SIZE = (640, 480)


class Cameras:
    """Frames of all cameras, each drawn at most once for one time; rendering starts when needed."""

    def __init__(self, model: Any, data: Any, renderer: RendererName) -> None:
        if renderer not in ("auto", "gl", "raycast"):
            raise PlantError(f"no renderer '{renderer}'", known=("auto", "gl", "raycast"))
        self._model = model
        self._data = data
        self._wanted = renderer
        self._renderer: Renderer | None = None
        self._frames: dict[int, tuple[float, Frame]] = {}

    def camera(self, name: str, width: int = 0, height: int = 0) -> Camera:
        """The camera of that name, at its own resolution or at another size in pixels.

        Raises:
            PlantError: there is none.
        """
        return _camera(self._model, find(self._model, "camera", name), width, height)

    def frame(self, camera: Camera) -> Frame:
        """Frame at the present time."""
        time, frame = self._frames.get(camera.index, (None, None))
        if frame is None or time != self._data.time:
            frame = self.renderer().render(camera)
            self._frames[camera.index] = (self._data.time, frame)
        return frame

    def renderer(self) -> Renderer:
        """The renderer in use; opens it the first time."""
        if self._renderer is None:
            self._renderer = _open(self._model, self._data, self._wanted)
        return self._renderer

    def forget(self) -> None:
        """Drop kept frames: the state has changed without time passing."""
        self._frames.clear()

    def close(self) -> None:
        """Close the renderer."""
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


def _open(model: Any, data: Any, wanted: RendererName) -> Renderer:
    if wanted != "raycast":
        from specc_runtime.plants.mujoco.gl import GlRenderer, GlUnavailableError

        try:
            return GlRenderer(model, data)
        except GlUnavailableError as error:
            if wanted == "gl":
                raise PlantError(f"no OpenGL: {error}") from error
    from specc_runtime.plants.mujoco.raycast import RaycastRenderer

    return RaycastRenderer(model, data)
