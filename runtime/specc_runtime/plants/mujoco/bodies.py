"""The bodies of a model for recordings: where they are and what they look like."""

from __future__ import annotations

from collections.abc import Iterator
from math import radians
from typing import Any

import numpy as np

from specc_runtime.operators.arrays import Array
from specc_runtime.plant import Mesh, Shape, Viewpoint
from specc_runtime.plants.mujoco.library import mujoco
from specc_runtime.plants.mujoco.surface import rgba, texture_of

_GEOM = mujoco.mjtGeom
_MESHES = _GEOM.mjGEOM_MESH.value, _GEOM.mjGEOM_SDF.value
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
        """Boxes, balls, cylinders and meshes.

        A capsule becomes a cylinder and two balls, a plane a flat box, a height field a mesh.
        """
        model = self._model
        for geom in range(model.ngeom):
            if model.geom_group[geom] >= _VISIBLE_GROUPS:
                continue
            name = self._name(int(model.geom_bodyid[geom]))
            pose = (*model.geom_pos[geom].tolist(), *model.geom_quat[geom].tolist())
            colour = tuple(rgba(model, geom).tolist())
            kind = model.geom_type[geom]
            if kind in _MESHES:
                yield Mesh(name, pose, colour, *_triangles(model, geom))
            elif kind == _GEOM.mjGEOM_HFIELD.value:
                yield Mesh(name, pose, colour, *_ground(model, model.geom_dataid[geom]))
            elif (edges := _edges(kind, model.geom_size[geom])) is not None:
                shape = Shape(name, *edges, pose, colour)
                yield shape
                if kind == _GEOM.mjGEOM_CAPSULE.value:
                    yield from _ends(shape)

    def viewpoints(self) -> list[Viewpoint]:
        """The cameras of the model that have a name."""
        model = self._model
        cameras = [camera for camera in range(model.ncam) if model.camera(camera).name]
        return [
            Viewpoint(
                model.camera(camera).name,
                self._name(int(model.cam_bodyid[camera])),
                (*model.cam_pos[camera].tolist(), *model.cam_quat[camera].tolist()),
                radians(float(model.cam_fovy[camera])),
            )
            for camera in cameras
        ]

    def _name(self, body: int) -> str:
        return self.names[body - 1] if body else "world"


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


def _ends(capsule: Shape) -> Iterator[Shape]:
    """The balls at the ends of a capsule, given its cylinder."""
    diameter, _, length = capsule.size
    place, turn = np.array(capsule.pose[:3]), np.array(capsule.pose[3:])
    axis = np.empty(3)
    mujoco.mju_rotVecQuat(axis, np.array((0.0, 0.0, length / 2)), turn)
    for end in (place - axis, place + axis):
        pose = (*end.tolist(), *capsule.pose[3:])
        yield Shape(capsule.body, "sphere", (diameter,) * 3, pose, capsule.colour)


def _ground(model: Any, field: int) -> tuple[Array, Array]:
    """Corners and triangles of the surface of a height field."""
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    half_x, half_y, top, _ = model.hfield_size[field]
    heights = model.hfield_data[model.hfield_adr[field] :][: rows * columns] * top
    y, x = np.meshgrid(
        np.linspace(-half_y, half_y, rows), np.linspace(-half_x, half_x, columns), indexing="ij"
    )
    corners = np.stack((x.ravel(), y.ravel(), heights), axis=1)
    first = np.arange(rows * columns).reshape(rows, columns)[:-1, :-1].ravel()
    right, up = first + 1, first + columns
    near, far = np.stack((first, right, up + 1), axis=1), np.stack((first, up + 1, up), axis=1)
    return corners, np.concatenate((near, far))


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
            return "cylinder", (a, a, b)
    return None
