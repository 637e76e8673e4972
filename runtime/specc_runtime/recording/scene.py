"""The bodies of a plant for a view in 3D, as messages of Foxglove: shapes once, poses again."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any, cast

from specc_runtime.examination import shortcomings
from specc_runtime.forms import Misshapen, Schema, object_schema
from specc_runtime.plant import Filmable, Mesh, Posed, Shape
from specc_runtime.recording.container import CHUNK_S
from specc_runtime.recording.log import Sinks
from specc_runtime.recording.models import MOST_OF_ALL, MOST_TRIANGLES, glb
from specc_runtime.recording.text import dumped, dumped_each, loaded
from specc_runtime.recording.times import TIME, stamped

PERIOD_S = 0.04
POSES, SHAPES = "/tf", "/scene"
"""Topics."""
_DECIMALS = 5
_PLACE = b'"translation":{"x":%%b,"y":%%b,"z":%%b},"rotation":{"w":%%b,"x":%%b,"y":%%b,"z":%%b}}'
_TEXT: Schema = {"type": "string"}


def _numbers(*names: str) -> Schema:
    return object_schema({name: {"type": "number"} for name in names})


_POSE = object_schema(
    {"position": _numbers("x", "y", "z"), "orientation": _numbers("x", "y", "z", "w")}
)
_COLOUR = _numbers("r", "g", "b", "a")
_TRANSFORM = object_schema(
    {
        "timestamp": TIME,
        "parent_frame_id": _TEXT,
        "child_frame_id": _TEXT,
        "translation": _numbers("x", "y", "z"),
        "rotation": _numbers("x", "y", "z", "w"),
    }
)
_SIZED = object_schema({"pose": _POSE, "size": _numbers("x", "y", "z"), "color": _COLOUR})
_CYLINDER = object_schema(
    _SIZED["properties"] | _numbers("bottom_scale", "top_scale")["properties"]
)
_MODEL = object_schema(
    {
        "pose": _POSE,
        "scale": _numbers("x", "y", "z"),
        "color": _COLOUR,
        "override_color": {"type": "boolean"},
        "url": _TEXT,
        "media_type": _TEXT,
        "data": {"type": "string", "contentEncoding": "base64"},
    }
)
_DELETION = object_schema({"timestamp": TIME, "type": {"type": "integer"}, "id": _TEXT})
_ENTITY = object_schema(
    {
        "timestamp": TIME,
        "frame_id": _TEXT,
        "id": _TEXT,
        "lifetime": TIME,
        "frame_locked": {"type": "boolean"},
        **{kind: {"type": "array", "items": _SIZED} for kind in ("cubes", "spheres")},
        "cylinders": {"type": "array", "items": _CYLINDER},
        "models": {"type": "array", "items": _MODEL},
        "metadata": {"type": "array", "items": object_schema({"key": _TEXT, "value": _TEXT})},
    }
)


class SceneWriter:
    """Writes the bodies of a plant."""

    def __init__(self, log: Sinks, plant: Posed) -> None:
        """Writes their shapes."""
        self._plant = plant
        self._names = tuple(plant.body_names())
        transforms = object_schema({"transforms": {"type": "array", "items": _TRANSFORM}})
        self._poses = log.channel(POSES, "foxglove.FrameTransforms", transforms, self._texts)
        body = b'{"timestamp":%%b,"parent_frame_id":"world","child_frame_id":%b,' + _PLACE
        each = b",".join(body % dumped(name).replace(b"%", b"%%") for name in self._names)
        self._template = b'{"transforms":[%b]}' % each
        entities = object_schema(
            {
                "deletions": {"type": "array", "items": _DELETION},
                "entities": {"type": "array", "items": _ENTITY},
            }
        )
        self._shapes = log.channel(SHAPES, "foxglove.SceneUpdate", entities)
        self._once_more = dumped(scene_of(plant))
        self._shapes.add(0.0, self._once_more)
        self._begun_s: float | None = None

    def note(self, time_s: float) -> None:
        """Write the poses of all bodies, and half a second later their shapes again."""
        if self._begun_s is None:
            self._begun_s = time_s
        if self._once_more and time_s - self._begun_s > CHUNK_S:
            self._shapes.add(time_s, self._once_more)
            self._once_more = b""
        self._poses.add(time_s, self._plant.body_poses().round(_DECIMALS))

    def _texts(
        self, moments: Sequence[Any], times: Sequence[float], dates: Sequence[int]
    ) -> Iterator[bytes]:
        for time_s, poses in zip(times, moments, strict=True):
            stamp = dumped(stamped(time_s)["timestamp"])
            rows = dumped_each(poses.ravel().tolist())
            values = [(stamp, *rows[i : i + 7]) for i in range(0, len(rows), 7)]
            yield self._template % tuple(chain.from_iterable(values))


def scene_of(plant: Posed) -> dict[str, Any]:
    """The message that has what all bodies look like, and where the cameras are.

    The metadata of a body has each of its cameras as `camera NAME`: the seven numbers of its pose
    and its vertical angle of view in rad.
    """
    found: dict[str, dict[str, Any]] = {}
    shapes = plant.shapes()
    meshes = sum(isinstance(shape, Mesh) for shape in shapes)
    most = min(MOST_TRIANGLES, MOST_OF_ALL // max(meshes, 1))
    for shape in shapes:
        entity = found.setdefault(shape.body, _entity(shape.body))
        if isinstance(shape, Mesh):
            entity.setdefault("models", []).append(_model(shape, most))
        else:
            entity.setdefault(f"{shape.kind}s", []).append(_primitive(shape))
    for viewpoint in () if shortcomings(plant, Filmable) else cast(Filmable, plant).viewpoints():
        entity = found.setdefault(viewpoint.body, _entity(viewpoint.body))
        value = " ".join(f"{number:.5g}" for number in (*viewpoint.pose, viewpoint.fovy))
        entity.setdefault("metadata", []).append(
            {"key": f"camera {viewpoint.camera}", "value": value}
        )
    return {"deletions": [], "entities": list(found.values())}


def _entity(body: str) -> dict[str, Any]:
    return stamped(0.0) | {
        "frame_id": body,
        "id": body,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
    }


def _placed(shape: Shape | Mesh) -> dict[str, Any]:
    x, y, z, w, i, j, k = shape.pose
    return {
        "pose": {
            "position": {"x": x, "y": y, "z": z},
            "orientation": {"x": i, "y": j, "z": k, "w": w},
        },
        "color": dict(zip("rgba", shape.colour, strict=True)),
    }


def _model(mesh: Mesh, most: int) -> dict[str, Any]:
    return _placed(mesh) | {
        "scale": {"x": 1.0, "y": 1.0, "z": 1.0},
        "override_color": False,
        "url": "",
        "media_type": "model/gltf-binary",
        "data": b64encode(glb(mesh, most)).decode(),
    }


def _primitive(shape: Shape) -> dict[str, Any]:
    message = _placed(shape) | {"size": dict(zip("xyz", shape.size, strict=True))}
    return message | ({"bottom_scale": 1.0, "top_scale": 1.0} if shape.kind == "cylinder" else {})


def poses_of(message: bytes) -> dict[str, list[float]]:
    """The poses of bodies by name: position, and the quaternion w, x, y, z. Raises Misshapen."""
    try:
        return {
            str(each["child_frame_id"]): [
                *(float(each["translation"][name]) for name in "xyz"),
                *(float(each["rotation"][name]) for name in "wxyz"),
            ]
            for each in loaded(message)["transforms"]
        }
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise Misshapen(f"no poses of bodies: {error}") from None
