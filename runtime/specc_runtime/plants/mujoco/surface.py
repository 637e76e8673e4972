"""The colour of surfaces that rays have hit: materials, textures of meshes, directional light."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from specc_runtime.operators.arrays import Array
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.texture import Image, pyramid, sample

_NO_COLOUR = np.array((0.5, 0.5, 0.5, 1.0), np.float32)  # rgba of a geom that was given none
_RGB = mujoco.mjtTextureRole.mjTEXROLE_RGB.value


@dataclass(frozen=True, slots=True)
class Hits:
    """Where n rays from one camera met surfaces, world axes.

    A ray is origin + depth * direction; directions have unit length along the optical axis.
    """

    geom: NDArray[np.int32]  # (n,)
    depth: Array  # (n,) m
    normal: Array  # (n, 3) outward unit normals
    direction: Array  # (n, 3)
    origin: Array  # (3,)
    pixel: Array  # (2, 3): change of direction from one pixel to the next, along u and v


@dataclass(frozen=True, slots=True)
class _Skin:
    """A textured mesh: an affine map from points to barycentric and texture coordinates.

    Row k of `weights` and `offset` gives, for triangle k, three barycentric coordinates and the
    distance from its plane in units of its size; `uv` has the corners' texture coordinates.
    """

    weights: Array  # (t, 4, 3)
    offset: Array  # (t, 4)
    uv: Array  # (t, 3, 2)
    levels: tuple[Image, ...]


class Surfaces:
    """Looks of all geoms of a model. Highlights are left out; other lights count as directional."""

    def __init__(self, model: Any) -> None:
        self._model = model
        self._colours = np.array([rgba(model, g)[:3] for g in range(model.ngeom)], np.float32)
        self._glow = np.array([_emission(model, g) for g in range(model.ngeom)], np.float32)
        self._skins = {g: s for g in range(model.ngeom) if (s := _skin(model, g)) is not None}

    def shade(self, state: Any, hits: Hits, forward: Array) -> NDArray[np.uint8]:
        """(n, 3) colours of hits in a state, for a camera that looks along `forward`."""
        colours = self._colours[hits.geom] * self._light(state, hits, forward)
        for geom, skin in self._skins.items():
            chosen = np.flatnonzero(hits.geom == geom)
            if chosen.size:
                colours[chosen] *= self._texture(state, skin, geom, hits, chosen) / np.float32(255)
        shaded: NDArray[np.uint8] = np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8)
        return shaded

    def _light(self, state: Any, hits: Hits, forward: Array) -> NDArray[np.float32]:
        """(n, 3) light that surfaces send back: own glow, ambient and diffuse."""
        model = self._model
        head = model.vis.headlight
        ambient, diffuse, towards = [], [], []
        if head.active:
            ambient.append(head.ambient)
            diffuse.append(head.diffuse)
            towards.append(-forward)
        for i in np.flatnonzero(model.light_active):
            ambient.append(model.light_ambient[i])
            diffuse.append(model.light_diffuse[i])
            towards.append(-state.light_xdir[i])
        light = np.repeat(self._glow[hits.geom][:, None], 3, axis=1)
        if towards:
            falling = np.maximum(hits.normal @ np.array(towards).T, 0).astype(np.float32)
            light += falling @ np.array(diffuse, np.float32)
            light += np.sum(ambient, axis=0, dtype=np.float32)
        return light

    def _texture(self, state: Any, skin: _Skin, geom: int, hits: Hits, chosen: Any) -> Image:
        """(k, 3) texture colours, 0..255, at the chosen hits."""
        rotation = state.geom_xmat[geom].reshape(3, 3)
        direction = hits.direction[chosen] @ rotation
        depth = hits.depth[chosen, None]
        points = depth * direction + (hits.origin - state.geom_xpos[geom]) @ rotation
        triangle, barycentric = _locate(skin, points)
        corners = skin.uv[triangle]
        uv = np.einsum("nk,nkj->nj", barycentric, corners)
        normal = hits.normal[chosen] @ rotation
        facing = np.einsum("ni,ni->n", normal, direction)
        texels = np.array(skin.levels[0].shape[1::-1], float)
        footprint = np.zeros(len(chosen))
        for step in hits.pixel @ rotation:
            # Move the hit by one pixel on its plane: depth changes so that it stays on it.
            slide = depth * (step - direction * ((normal @ step) / facing)[:, None])
            change = np.einsum("nki,ni->nk", skin.weights[triangle, :3], slide)
            moved = np.einsum("nk,nkj->nj", change, corners) * texels
            footprint = np.maximum(footprint, np.hypot(moved[:, 0], moved[:, 1]))
        return sample(skin.levels, uv.astype(np.float32), footprint.astype(np.float32))


def _locate(skin: _Skin, points: Array) -> tuple[NDArray[np.intp], Array]:
    """Triangle (n,) on which each point lies, and its barycentric coordinates (n, 3) there."""
    coordinates = np.einsum("tki,ni->ntk", skin.weights, points) + skin.offset
    inside = coordinates[:, :, :3].min(axis=2) - np.abs(coordinates[:, :, 3])
    triangle = inside.argmax(axis=1)
    return triangle, coordinates[np.arange(len(points)), triangle, :3]


def rgba(model: Any, geom: int) -> Array:
    """Colour of a geom, 0..1: its own if it was given one, else its material's."""
    own = model.geom_rgba[geom]
    material = model.geom_matid[geom]
    if material >= 0 and np.array_equal(own, _NO_COLOUR):
        own = model.mat_rgba[material]
    return np.array(own, float)


def _emission(model: Any, geom: int) -> float:
    material = model.geom_matid[geom]
    return float(model.mat_emission[material]) if material >= 0 else 0.0


def _skin(model: Any, geom: int) -> _Skin | None:
    """The textured mesh of a geom, none if it is not one."""
    mesh, texture = model.geom_dataid[geom], texture_of(model, geom)
    if texture is None:
        return None
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][model.mesh_face[faces]].astype(float)
    start = model.mesh_texcoordadr[mesh]
    uv = model.mesh_texcoord[start:][model.mesh_facetexcoord[faces]].astype(float)
    weights, offset = _barycentric_maps(vertices)
    return _Skin(weights, offset, uv, pyramid(texture))


def texture_of(model: Any, geom: int) -> NDArray[np.uint8] | None:
    """(h, w, 3) texels of the texture of a mesh, None for a geom that is none or has none."""
    material, mesh = model.geom_matid[geom], model.geom_dataid[geom]
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH.value or material < 0:
        return None
    texture = int(model.mat_texid[material][_RGB])
    if texture < 0 or model.mesh_texcoordnum[mesh] == 0:
        return None
    return _image(model, texture)


def _barycentric_maps(vertices: Array) -> tuple[Array, Array]:
    """For triangles (t, 3, 3): linear parts (t, 4, 3) and offsets (t, 4), see `_Skin`."""
    first = vertices[:, 0]
    a, b = vertices[:, 1] - first, vertices[:, 2] - first
    normal = np.cross(a, b)
    normal /= np.sqrt(np.linalg.norm(normal, axis=1))[:, None]  # as long as the triangle is large
    inverse = np.linalg.inv(np.stack((a, b, normal), axis=2))
    weights = np.concatenate((-inverse[:, :1] - inverse[:, 1:2], inverse), axis=1)
    offset = -np.einsum("tki,ti->tk", weights, first)
    offset[:, 0] += 1.0
    return weights, offset


def _image(model: Any, texture: int) -> NDArray[np.uint8]:
    """(h, w, 3) texels of a texture."""
    height, width = int(model.tex_height[texture]), int(model.tex_width[texture])
    channels, start = int(model.tex_nchannel[texture]), int(model.tex_adr[texture])
    texels = model.tex_data[start : start + height * width * channels]
    image = np.asarray(texels).reshape(height, width, channels)[:, :, :3]
    return np.repeat(image, 3, axis=2) if channels == 1 else np.array(image)
