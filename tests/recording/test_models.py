"""Meshes in recordings: files of glTF that hold to its rules, and are where the meshes are."""

from __future__ import annotations

import json
from base64 import b64decode
from pathlib import Path
from struct import unpack_from
from typing import Any

import cv2
import mujoco
import numpy as np
import pytest
from specc_runtime.clock import WallClock
from specc_runtime.plant import Mesh, Shape
from specc_runtime.plants.mujoco.bodies import Bodies
from specc_runtime.recording.log import Log
from specc_runtime.recording.models import MOST_TRIANGLES, coarser, glb
from specc_runtime.recording.scene import SceneWriter, scene_of

from tests.recording.runs import ROOT, messages

Array = np.ndarray[Any, Any]
CORNERS = np.array([(0, 0, 0), (0.4, 0, 0), (0, 0.3, 0), (0, 0, 0.2)])
ROBOT = """<mujoco>
  <asset>
    <material name="paint" rgba="0.1 0.2 0.3 1"/>
    <mesh name="link" vertex="0 0 0  0.4 0 0  0 0.3 0  0 0 0.2"/>
  </asset>
  <worldbody>
    <body name="arm" pos="1 2 3" euler="10 20 30">
      <freejoint/>
      <geom type="mesh" mesh="link" pos="0.1 0 0.2" euler="0 90 0" material="paint"/>
      <geom type="mesh" mesh="link" group="3"/>
      <geom type="sphere" size="0.1" rgba="1 0 0 1"/>
    </body>
  </worldbody>
</mujoco>"""
SIZES = {5126: "<f4", 5125: "<u4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
pytestmark = pytest.mark.no_replay("not of runs")


class Posed:
    def __init__(self, model: Any) -> None:
        self._data = mujoco.MjData(model)
        mujoco.mj_forward(model, self._data)
        self._bodies = Bodies(model, self._data)
        self.body_names = lambda: self._bodies.names
        self.body_poses = self._bodies.poses
        self.shapes = lambda: [*self._bodies.shapes()]
        self.viewpoints: Any = None


def _opened(data: bytes) -> tuple[dict[str, Any], list[Array], list[bytes]]:
    """What a GLB tells, its accessors and its views, read strictly by the specification."""
    magic, version, length = unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = unpack_from("<I4s", data, 12)
    assert kind == b"JSON" and size % 4 == 0
    told = json.loads(data[20 : 20 + size])
    binary_size, kind = unpack_from("<I4s", data, 20 + size)
    assert kind == b"BIN\0" and binary_size % 4 == 0 and 28 + size + binary_size == len(data)
    binary = data[28 + size :]
    assert told["asset"]["version"] == "2.0"
    assert 0 <= binary_size - told["buffers"][0]["byteLength"] < 4
    views = []
    for view in told["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        views.append(binary[view["byteOffset"] :][: view["byteLength"]])
        assert len(views[-1]) == view["byteLength"]
    found = []
    for item in told["accessors"]:
        array = np.frombuffer(views[item["bufferView"]], SIZES[item["componentType"]])
        found.append(array.reshape(item["count"], WIDTHS[item["type"]]))
    positions, indices = found[:2]
    np.testing.assert_array_equal(told["accessors"][0]["min"], positions.min(axis=0))
    np.testing.assert_array_equal(told["accessors"][0]["max"], positions.max(axis=0))
    assert indices.max() < len(positions) and len(indices) % 3 == 0
    return told, found, views


def _turned(quaternion: Any) -> Array:
    """The rotation of x, y, z, w."""
    x, y, z, w = quaternion
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.array((w, x, y, z)))
    return matrix.reshape(3, 3)


def _shown(model: dict[str, Any], body: tuple[Array, Array]) -> Array:
    """Where a viewer puts the corners: it turns what glTF has upright, then places the model."""
    told, (positions, *_), _ = _opened(b64decode(model["data"]))
    upright = np.array([(1, 0, 0), (0, 0, -1), (0, 1, 0)])
    own = positions.astype(float) @ (upright @ _turned(told["nodes"][0]["rotation"])).T
    pose = model["pose"]
    place = [pose["position"][axis] for axis in "xyz"]
    turn = _turned([pose["orientation"][axis] for axis in "xyzw"])
    origin, axes = body
    return (own @ turn.T + place) @ axes.T + origin


def _scene(plant: Posed, file: Path) -> list[Any]:
    log = Log(file, WallClock())
    scene = SceneWriter(log, plant)
    for time_s in (0.0, 0.4, 0.8, 1.2):
        scene.note(time_s)
    log.close()
    return [data for _, data in messages(file)["/scene"]]


def test_meshes_are_shown_where_they_are(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(ROBOT)
    plant = Posed(model)
    first, second = _scene(plant, tmp_path / "x.mcap")
    assert first == second
    (entity,) = first["entities"]
    (found,) = entity["models"]
    assert entity["id"] == "arm" and len(entity["spheres"]) == 1
    data = plant._data
    shown = _shown(found, (data.xpos[1], data.xmat[1].reshape(3, 3)))
    turn = _turned((0, 0.5**0.5, 0, 0.5**0.5))
    expected = CORNERS @ turn.T + (0.1, 0, 0.2)
    expected = expected @ data.xmat[1].reshape(3, 3).T + data.xpos[1]
    order = [np.linalg.norm(shown - corner, axis=1).argmin() for corner in expected]
    assert sorted(order) == [0, 1, 2, 3]
    np.testing.assert_allclose(shown[order], expected, atol=1e-5)
    told, _, _ = _opened(b64decode(found["data"]))
    look = told["materials"][0]["pbrMetallicRoughness"]
    np.testing.assert_allclose(look["baseColorFactor"], (0.1, 0.2, 0.3, 1), atol=1e-6)


def test_textures_come_along() -> None:
    model = mujoco.MjModel.from_xml_path(str(ROOT / "specs" / "plants" / "irp6_picking.xml"))
    meshes = [shape for shape in Posed(model).shapes() if isinstance(shape, Mesh)]
    assert len(meshes) == 3
    for mesh in meshes:
        told, (positions, indices, uv), views = _opened(glb(mesh))
        assert len(indices) == 3 * len(mesh.triangles) and len(uv) == len(positions)
        assert uv.min() >= 0 and uv.max() <= 1
        assert told["images"][0] == {"bufferView": 3, "mimeType": "image/png"}
        drawn = cv2.imdecode(np.frombuffer(views[3], np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
        every = -(-max(mesh.texels.shape[:2]) // 256)
        np.testing.assert_array_equal(drawn, mesh.texels[::every, ::every])


def _ball(count: int) -> tuple[Array, Array]:
    """Corners on a sphere of 1 m, and two triangles for each patch between four of them."""
    u, v = np.meshgrid(np.linspace(0, np.pi, count), np.linspace(0, 2 * np.pi, count))
    corners = np.stack((np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)), axis=-1)
    at = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    one = np.stack((at, at + 1, at + count), axis=1)
    other = np.stack((at + 1, at + count + 1, at + count), axis=1)
    return corners.reshape(-1, 3), np.concatenate((one, other))


@pytest.mark.long
def test_large_meshes_get_coarser() -> None:
    corners, triangles = _ball(300)
    assert len(triangles) > 15 * MOST_TRIANGLES
    kept, found = coarser(corners, triangles, MOST_TRIANGLES)
    assert MOST_TRIANGLES / 8 < len(found) <= MOST_TRIANGLES
    assert found.max() < len(kept)
    radius = np.linalg.norm(kept, axis=1)
    assert radius.max() < 1.0 + 1e-12 and radius.min() > 0.99
    mesh = Mesh("a", (0,) * 7, (1, 1, 1, 1), corners, triangles)
    assert len(glb(mesh)) < 300_000
    _opened(glb(mesh))
    few, same = coarser(corners[:9], triangles[:5] % 9, 5)
    assert len(few) == 9 and len(same) == 5


SOLIDS = """<mujoco>
  <asset><hfield name="hills" nrow="3" ncol="4" size="1 2 0.5 0.1"
    elevation="0 0 0 0  0 1 0 0  0 0 0 0"/></asset>
  <worldbody>
    <camera name="overview" pos="0 -3 1" euler="70 0 0" fovy="40"/>
    <camera pos="0 0 1"/>
    <geom type="hfield" hfield="hills" pos="0 0 1"/>
    <body name="arm" pos="9 2 3">
      <camera name="eye" pos="0 0.1 0"/>
      <geom type="capsule" fromto="0 0 0  0.3 0 0" size="0.05" rgba="1 0 0 0.5"/>
    </body>
  </worldbody>
</mujoco>"""


def test_capsules_have_round_ends() -> None:
    found = [s for s in Posed(mujoco.MjModel.from_xml_string(SOLIDS)).shapes() if s.body == "arm"]
    assert [shape.kind for shape in found if isinstance(shape, Shape)] == [
        "cylinder", "sphere", "sphere",
    ]  # fmt: skip
    (cylinder, *balls) = found
    np.testing.assert_allclose(cylinder.size, (0.1, 0.1, 0.3))
    ends = sorted(ball.pose[:3] for ball in balls)
    np.testing.assert_allclose(ends, [(0, 0, 0), (0.3, 0, 0)], atol=1e-12)
    assert {(ball.size, ball.colour) for ball in balls} == {((0.1, 0.1, 0.1), cylinder.colour)}


def test_height_fields_are_meshes() -> None:
    model = mujoco.MjModel.from_xml_string(SOLIDS)
    (mesh,) = [shape for shape in Posed(model).shapes() if isinstance(shape, Mesh)]
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert len(mesh.corners) == 12 and len(mesh.triangles) == 12
    for x, y, z in mesh.corners.tolist():
        above, down = np.array((x * 0.999, y * 0.999, 9.0)), np.array((0.0, 0.0, -1.0))
        distance = mujoco.mj_ray(model, data, above, down, None, 1, -1, np.zeros(1, np.int32))
        assert 9.0 - distance == pytest.approx(z + 1.0, abs=0.01)
    a, b, c = np.moveaxis(mesh.corners[mesh.triangles], 1, 0)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()  # all of them face upwards


def test_a_scene_has_the_cameras_with_names() -> None:
    model = mujoco.MjModel.from_xml_string(SOLIDS)
    plant = Posed(model)
    plant.viewpoints = plant._bodies.viewpoints
    entities = {entity["id"]: entity for entity in scene_of(plant)["entities"]}
    (overview,) = entities["world"]["metadata"]
    (eye,) = entities["arm"]["metadata"]
    assert (overview["key"], eye["key"]) == ("camera overview", "camera eye")
    *place, w, x, y, z, fovy = map(float, overview["value"].split())
    assert place == [0, -3, 1] and fovy == pytest.approx(np.deg2rad(40), abs=1e-4)
    data = plant._data
    np.testing.assert_allclose(
        _turned((x, y, z, w)), data.cam_xmat[model.camera("overview").id].reshape(3, 3), atol=1e-4
    )
    assert eye["value"].startswith("0 0.1 0 1 0 0 0 ")
