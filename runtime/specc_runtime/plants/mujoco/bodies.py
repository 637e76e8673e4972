"""The bodies of a model for recordings: where they are and what they look like."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.plant import Mesh, Shape
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.surface import rgba, texture_of

_GEOM = mujoco.mjtGeom
_VISIBLE_GROUPS = 3
"""MuJoCo's own viewer shows geoms of the groups below this one."""


class Bodies:
    """All bodies but the world, in the order of the model."""

    def __init__(self, model: Any, data: Any) -> None:
        self._model, self._data = model, data
        ids = range(1, model.nbody)
        self.names = tuple(model.body(i).name or f"body {i}" for i in ids)

    def poses(self) -> Array:
        """(n, 7): x, y, z in m, quaternion w, x, y, z in the world."""
        return np.hstack((self._data.xpos[1:], self._data.xquat[1:]))

    def shapes(self) -> Iterator[Shape | Mesh]:
        """Boxes, balls, cylinders and meshes; capsules become cylinders, planes flat boxes."""
        model = self._model
        for geom in range(model.ngeom):
            if model.geom_group[geom] >= _VISIBLE_GROUPS:
                continue
            body = int(model.geom_bodyid[geom])
            name = self.names[body - 1] if body else "world"
            pose = (*model.geom_pos[geom].tolist(), *model.geom_quat[geom].tolist())
            colour = tuple(rgba(model, geom).tolist())
            if model.geom_type[geom] == _GEOM.mjGEOM_MESH.value:
                yield Mesh(name, pose, colour, *_triangles(model, geom))
            elif (size := _edges(model.geom_type[geom], model.geom_size[geom])) is not None:
                yield Shape(name, *size, pose, colour)


def _triangles(model: Any, geom: int) -> tuple[Any, Any, Any, Any]:
    """Corners and triangles of a mesh; where the corners are on its texture, and that."""
    mesh, texels = model.geom_dataid[geom], texture_of(model, geom)
    faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    corners = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]]
    triangles = np.array(model.mesh_face[faces])
    if texels is None:
        return np.array(corners), triangles, None, None
    both = np.stack((triangles.ravel(), model.mesh_facetexcoord[faces].ravel()), axis=1)
    pairs, of = np.unique(both, axis=0, return_inverse=True)
    uv = model.mesh_texcoord[model.mesh_texcoordadr[mesh] :][pairs[:, 1]]
    return corners[pairs[:, 0]], of.reshape(-1, 3), uv, texels


def _edges(kind: int, size: Array) -> tuple[str, tuple[float, float, float]] | None:
    """The primitive of Foxglove for a geom and its extent along each axis, if it has one."""
    a, b, c = (2.0 * float(s) for s in size)
    match kind:
        case _GEOM.mjGEOM_BOX.value:
            return "cube", (a, b, c)
        case _GEOM.mjGEOM_PLANE.value:
            return "cube", (a or 10.0, b or 10.0, 0.001)
        case _GEOM.mjGEOM_SPHERE.value:
            return "sphere", (a, a, a)
        case _GEOM.mjGEOM_ELLIPSOID.value:
            return "sphere", (a, b, c)
        case _GEOM.mjGEOM_CYLINDER.value:
            return "cylinder", (a, a, b)
        case _GEOM.mjGEOM_CAPSULE.value:
            return "cylinder", (a, a, b + a)
    return None
