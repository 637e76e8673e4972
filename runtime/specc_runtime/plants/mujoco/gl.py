"""Camera images by OpenGL: EGL, else OSMesa, else a hidden window."""

import os
from collections.abc import Sequence
from ctypes import CDLL
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from specc_runtime.plants.mujoco.coarse import coarse
from specc_runtime.plants.mujoco.library import GL_VARIABLE, mujoco
from specc_runtime.plants.mujoco.view import Camera, Frame

_MAX_GEOMS = 2000
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")
"""In the names of what draws on the processor."""
_USUAL_TEXELS, _SHADOW_TEXELS = 4096, 1024
"""Along an edge of the shadow map: MuJoCo's own, and what stands for that, or for more, in pictures
that the processor draws. A model that says less gets what it says."""
_PIXELS_OF_TRIANGLE = 3
"""More triangles than one for so many pixels are not seen in a picture."""
# Shared libraries without which a backend cannot start.
_NEEDS = {"egl": ("EGL", "OpenGL"), "osmesa": ("OSMesa",), "glfw": ("GL",)}


class GlUnavailableError(Exception):
    """No OpenGL backend works here."""


class GlRenderer:
    """Draws with MuJoCo's own renderer.

    Sensor frames have neither shadows nor multisampling: textures are mip-mapped anyway, and colour
    and depth then come from one pass. Pictures have shadows; on a graphics processor as the model
    says, else smaller ones, no multisampling, and meshes as fine as the picture can show them.
    """

    def __init__(self, model: Any) -> None:
        self._model = model
        # A scene keeps more of a camera than the next one replaces: pictures would change the last
        # bits of the depth of later frames.
        self._scenes = tuple(mujoco.MjvScene(model, _MAX_GEOMS) for _ in range(2))
        self._options = tuple(mujoco.MjvOption() for _ in range(2))
        for option in self._options:
            option.sitegroup[:] = 0
        self._gl = _open_context(int(model.vis.global_.offwidth), int(model.vis.global_.offheight))
        self._is_software = _is_software()
        self._samples = int(model.vis.quality.offsamples)
        self._contexts: dict[tuple[bool, int, int], Any] = {}

    def render(self, camera: Camera, state: Any) -> Frame:
        """See `view.Renderer`."""
        context = self._context(camera, decorated=False)
        rgb, window_depth = self._draw(camera, state, context, decorated=False)
        return Frame(rgb, self._metres(window_depth))

    def picture(
        self, camera: Camera, state: Any, groups: Sequence[int] | None = None
    ) -> NDArray[np.uint8]:
        """See `view.Renderer`."""
        if groups is not None:
            self._options[True].geomgroup[:] = [group in groups for group in range(6)]
        image: NDArray[np.uint8]
        context = self._context(camera, decorated=True)
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
        option = self._options[decorated]
        mujoco.mjv_updateScene(self._model, state, option, None, view, everything, scene)
        scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW.value] = decorated
        scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION.value] = decorated
        rgb = np.empty((camera.height, camera.width, 3), np.uint8)
        depth = None if decorated else np.empty((camera.height, camera.width), np.float32)
        window = mujoco.MjrRect(0, 0, camera.width, camera.height)
        mujoco.mjr_render(window, scene, context)
        mujoco.mjr_readPixels(rgb, depth, window, context)
        # OpenGL's first row is the lowest one.
        return rgb[::-1].copy(), None if depth is None else depth[::-1]

    def _context(self, camera: Camera, *, decorated: bool) -> Any:
        """What draws into a buffer as large as a frame, all of which is cleared.

        The buffer is the present one from here on.
        """
        self._gl.make_current()
        key = decorated, camera.width, camera.height
        if key not in self._contexts:
            model = self._drawn(camera) if decorated else self._model
            visual = model.vis
            visual.quality.offsamples = 0 if not decorated or self._is_software else self._samples
            visual.global_.offwidth, visual.global_.offheight = camera.width, camera.height
            context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
            context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR.value
            self._contexts[key] = context
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._contexts[key])
        return self._contexts[key]

    def _drawn(self, camera: Camera) -> Any:
        """The model of pictures: one that a processor can draw, where that has to."""
        if not self._is_software:
            return self._model
        model = coarse(self._model, camera.width * camera.height // _PIXELS_OF_TRIANGLE)
        quality = model.vis.quality
        if quality.shadowsize >= _USUAL_TEXELS:
            quality.shadowsize = _SHADOW_TEXELS
        return model

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
    wanted = os.environ.get(GL_VARIABLE, "").lower()
    problems = []
    for backend in (wanted,) if wanted in _NEEDS else _NEEDS:
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
    if backend == "glfw" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise GlUnavailableError("no display")
    context = import_module(f"mujoco.{backend}").GLContext(width, height)
    context.make_current()
    return context


def _is_software() -> bool:
    """Whether the processor draws in the present context, as its name says."""
    gl = import_module("OpenGL.GL")
    name = gl.glGetString(gl.GL_RENDERER) or b""
    return any(word in name.decode(errors="replace").lower() for word in _SOFTWARE)
