"""Camera images by OpenGL: EGL, else OSMesa, else a hidden window."""

import os
from ctypes import CDLL
from typing import Any

import numpy as np
from numpy.typing import NDArray

from specc_runtime.plants.mujoco.library import GL_VARIABLE, mujoco
from specc_runtime.plants.mujoco.view import Camera, Frame

_MAX_GEOMS = 2000
# Shared libraries without which a backend cannot start.
_NEEDS = {"egl": ("EGL", "OpenGL"), "osmesa": ("OSMesa",), "glfw": ("GL",)}


class GlUnavailableError(Exception):
    """No OpenGL backend works here."""


class GlRenderer:
    """Draws with MuJoCo's own renderer.

    Sensor frames have neither shadows nor multisampling: textures are mip-mapped anyway, and colour
    and depth then come from one pass. Pictures have shadows and the model's own multisampling.
    """

    def __init__(self, model: Any) -> None:
        self._model = model
        # A scene keeps more of a camera than the next one replaces: pictures would change the last
        # bits of the depth of later frames.
        self._scenes = tuple(mujoco.MjvScene(model, _MAX_GEOMS) for _ in range(2))
        self._option = mujoco.MjvOption()
        self._option.sitegroup[:] = 0
        self._size = int(model.vis.global_.offwidth), int(model.vis.global_.offheight)
        self._gl = _open_context(*self._size)
        self._samples = int(model.vis.quality.offsamples)
        self._contexts: dict[tuple[int, int, int], Any] = {}

    def render(self, camera: Camera, state: Any) -> Frame:
        """See `view.Renderer`."""
        # A buffer as large as the frame: all of it is cleared.
        context = self._context(0, camera.width, camera.height)
        rgb, window_depth = self._draw(camera, state, context, decorated=False)
        return Frame(rgb, self._metres(window_depth))

    def picture(self, camera: Camera, state: Any) -> NDArray[np.uint8]:
        """See `view.Renderer`."""
        image: NDArray[np.uint8]
        context = self._context(self._samples, *self._size)
        image, _ = self._draw(camera, state, context, decorated=True)
        return image

    def close(self) -> None:
        """See `view.Renderer`."""
        self._gl.make_current()
        for context in self._contexts.values():
            context.free()
        self._contexts.clear()
        self._gl.free()

    def _draw(self, camera: Camera, state: Any, context: Any, decorated: bool) -> tuple[Any, Any]:
        scene = self._scenes[decorated]
        view = mujoco.MjvCamera()
        view.type = mujoco.mjtCamera.mjCAMERA_FIXED.value
        view.fixedcamid = camera.index
        everything = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, state, self._option, None, view, everything, scene)
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW.value] = decorated
        scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION.value] = decorated
        rgb = np.empty((camera.height, camera.width, 3), np.uint8)
        depth = None if decorated else np.empty((camera.height, camera.width), np.float32)
        window = mujoco.MjrRect(0, 0, camera.width, camera.height)
        mujoco.mjr_render(window, scene, context)
        mujoco.mjr_readPixels(rgb, depth, window, context)
        # OpenGL's first row is the lowest one.
        return rgb[::-1].copy(), None if depth is None else depth[::-1]

    def _context(self, samples: int, width: int, height: int) -> Any:
        """What draws into a buffer of that size, which is the present one from here on."""
        self._gl.make_current()
        key = samples, width, height
        if key not in self._contexts:
            visual = self._model.vis
            visual.quality.offsamples = samples
            visual.global_.offwidth, visual.global_.offheight = width, height
            context = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
            context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR.value
            self._contexts[key] = context
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._contexts[key])
        return self._contexts[key]

    def _metres(self, window_depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance along the optical axis from reversed window depth (1 near, 0 far).

        depth = n (f - z) / (z (f - n)) for the planes n, f of the frustum, solved for z.
        """
        near = self._model.vis.map.znear * self._model.stat.extent
        far = self._model.vis.map.zfar * self._model.stat.extent
        offset = near / (far - near)
        metres = window_depth + np.float32(offset)
        np.divide(np.float32(far * offset), metres, out=metres)
        metres[window_depth <= 0] = 0
        return metres


def _open_context(width: int, height: int) -> Any:
    """A current OpenGL context of the first backend that works.

    PyOpenGL binds itself to one backend per process: after one fails that had its libraries,
    the next may fail for that reason alone.
    """
    asked = os.environ.get(GL_VARIABLE, "").lower()
    problems = []
    for backend in (asked,) if asked in _NEEDS else _NEEDS:
        missing = [name for name in _NEEDS[backend] if not is_there(name)]
        if missing:
            problems.append(f"{backend} needs the library {', '.join(missing)}")
            continue
        try:
            return _context_of(backend, width, height)
        except Exception as error:  # noqa: BLE001  whatever a graphics stack raises, it is not there
            problems.append(f"{backend}: {error}")
    raise GlUnavailableError("; ".join(problems))


def is_there(library: str) -> bool:
    """Whether a shared library loads, in any version.

    `ctypes.util.find_library` would start other programs to look for it.
    """
    for version in ("", *(f".{number}" for number in reversed(range(10)))):
        try:
            CDLL(f"lib{library}.so{version}")
        except OSError:
            continue
        return True
    return False


def _context_of(backend: str, width: int, height: int) -> Any:
    import importlib

    if backend == "glfw" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise GlUnavailableError("no display")
    context = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
    context.make_current()
    return context
