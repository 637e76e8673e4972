"""Values of elements from messages of ROS 2 and back: pure functions of plain data.

A message is a mapping of its fields by name, a nested one a mapping in it, an array of bytes is
bytes. Units are those of REP 103, which are SI's, and quaternions are x, y, z, w: nothing is
converted but depth in millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from specc_runtime.builtins import pose
from specc_runtime.plants.errors import PlantError
from specc_runtime.ros2.binding import Ros2Topic

Array = np.ndarray[Any, Any]
Data = Mapping[str, Any]

# Of a whole message.


def value_of(topic: Ros2Topic, message: Data) -> Any:
    """The value that a message has for an element; contracts look at it afterwards.

    Raises PlantError for a frame that is not that of the element, and for joints that are missing.
    """
    for path, wanted in topic.frames:
        frame: str = _at(message, path)
        if frame.removeprefix("/") != wanted:
            raise PlantError(f"{topic.topic}: `{path}` is `{frame}`, where `{wanted}` is declared")
    if topic.shape == "message":
        return Message(message)
    if topic.shape == "joints":
        return _by_joint(topic, message)
    read, _ = _SHAPES[topic.shape]
    return read(_at(message, topic.path))


def message_of(topic: Ros2Topic, value: Any) -> dict[str, Any]:
    """The fields of a message that are set for a value; a header's stamp is set when it is sent.

    A value that a function of `through` made is a mapping of fields already.
    """
    if topic.shape == "message":
        made: dict[str, Any] = _plain(value)
        return made
    if topic.shape == "joints":
        numbers = [float(value)] if topic.is_number else value.tolist()
        where, _, field = topic.path.rpartition(".")
        body: dict[str, Any] = _below(where, {"name": list(topic.joints), field: numbers})
    elif topic.shape == "trajectory":
        points = [value] if _names(value) else value
        of_joints = {"joint_names": list(topic.joints), "points": [_sent(each) for each in points]}
        body = _below(topic.path, of_joints)
    else:
        _, write = _SHAPES[topic.shape]
        body = _below(topic.path, write(value))
    for path, frame in topic.frames:
        body = _merged(body, _below(path, frame))
    return body


class Message:
    """A message for a function of `through`: fields are attributes, nested ones messages, too."""

    __slots__ = ("_fields",)

    def __init__(self, fields: Data) -> None:
        self._fields = fields

    def __getattr__(self, name: str) -> Any:
        """The field; raises AttributeError with those that there are."""
        try:
            value = self._fields[name]
        except KeyError:
            known = ", ".join(self._fields)
            raise AttributeError(f"the message has no field {name!r}: it has {known}") from None
        return _wrapped(value)

    def __repr__(self) -> str:
        return f"Message({self._fields!r})"


def _wrapped(value: Any) -> Any:
    if isinstance(value, dict):
        return Message(value)
    return [_wrapped(item) for item in value] if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    """Fields that a function made, without arrays and numbers of numpy."""
    if isinstance(value, Message):
        return value._fields
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, np.ndarray):
        return value.tobytes() if value.dtype == np.uint8 else value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def _at(message: Data, path: str) -> Any:
    found: Any = message
    for name in filter(None, path.split(".")):
        if not isinstance(found, Mapping) or name not in found:
            known = f": it has {', '.join(found)}" if isinstance(found, Mapping) else ""
            raise PlantError(f"a message has no field `{path}`{known}")
        found = found[name]
    return found


def _below(path: str, value: Any) -> Any:
    for name in reversed(list(filter(None, path.split(".")))):
        value = {name: value}
    return value


def _merged(one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    both = {k: _merged(one[k], other[k]) for k in one.keys() & other.keys()}
    return {**one, **other, **both}


# Of the part that has the value.


def _by_joint(topic: Ros2Topic, message: Data) -> Any:
    """Numbers of the joints that the topic names, whatever their order in the message."""
    where, _, field = topic.path.rpartition(".")
    numbers = _at(message, topic.path)
    names = message["joint_names"] if "joint_names" in message else _at(message, where)["name"]
    at = dict(zip(names, numbers, strict=False))
    if missing := [joint for joint in topic.joints if joint not in at]:
        if len(numbers) < len(names):
            raise PlantError(
                f"{topic.topic} has {len(numbers)} numbers in `{field}` for {len(names)} "
                "joints: its publisher does not fill that field for all of them"
            )
        raise PlantError(
            f"{topic.topic} has no joint {', '.join(missing)}: it has {', '.join(names)}"
        )
    found = [float(at[joint]) for joint in topic.joints]
    return found[0] if topic.is_number else np.array(found)


def _axes(data: Data) -> list[float]:
    return [float(data[axis]) for axis in "xyz"]


def _named(numbers: Iterable[float], axes: str = "xyz") -> dict[str, float]:
    return dict(zip(axes, map(float, numbers), strict=True))


def _turned(data: Data) -> Array:
    """x, y, z, w of a message; the length is 1 up to rounding of 32 bits, or it is none."""
    numbers = np.array([float(data[axis]) for axis in "xyzw"])
    length = float(np.linalg.norm(numbers))
    if abs(length - 1.0) > 1e-3:
        raise PlantError(f"a quaternion of length {length:.6g} is no orientation")
    return numbers


def _pose(position: str, orientation: str) -> tuple[Callable[[Data], Any], Callable[[Any], Any]]:
    """Reader and writer of poses, whose parts go by these names."""

    def read(data: Data) -> Array:
        return pose(np.array(_axes(data[position])), _turned(data[orientation]))

    def write(value: Array) -> dict[str, Any]:
        return {
            position: _named(value[:3, 3]),
            orientation: _named(quaternion_xyzw(value[:3, :3]), "xyzw"),
        }

    return read, write


def quaternion_xyzw(rotation: Array) -> Array:
    """The quaternion x, y, z, w of unit length, with w >= 0, of a rotation (3, 3)."""
    (a, b, c), (d, e, f), (g, h, i) = rotation.tolist()
    candidates = (
        (1 + a - e - i, b + d, c + g, h - f),
        (b + d, 1 - a + e - i, f + h, c - g),
        (c + g, f + h, 1 - a - e + i, d - b),
        (h - f, c - g, d - b, 1 + a + e + i),
    )
    # Each is the quaternion times four times one of its parts: the longest loses nothing.
    longest = max(candidates, key=lambda each: math.hypot(*each))
    unit = np.array(longest) / math.hypot(*longest)
    return -unit if unit[3] < 0 else unit


def _spatial(linear: str, angular: str) -> tuple[Callable[[Data], Any], Callable[[Any], Any]]:
    def read(data: Data) -> Array:
        return np.array([*_axes(data[linear]), *_axes(data[angular])])

    def write(value: Array) -> dict[str, Any]:
        return {linear: _named(value[:3]), angular: _named(value[3:])}

    return read, write


_COLOURS = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "rgba8": (0, 1, 2), "bgra8": (2, 1, 0)}
"""Encodings, and at which byte of a pixel red, green and blue are."""


def _rgb(data: Data) -> Array:
    """(height, width, 3) of uint8."""
    encoding = data["encoding"]
    if encoding not in _COLOURS:
        known = ", ".join(_COLOURS)
        raise PlantError(f"an image encoded as `{encoding}` has no colours; known are {known}")
    channels = 4 if "a" in encoding else 3
    pixels = _pixels(data, np.dtype(np.uint8), channels)
    return np.ascontiguousarray(pixels[:, :, _COLOURS[encoding]])


def _depth(data: Data) -> Array:
    """(height, width) of float32, in m, 0 where there is no reading."""
    encoding = data["encoding"]
    order = ">" if data["is_bigendian"] else "<"
    if encoding in ("16UC1", "mono16"):
        millimetres = _pixels(data, np.dtype(f"{order}u2"), 1)[:, :, 0]
        return millimetres.astype(np.float32) * np.float32(1e-3)
    if encoding == "32FC1":
        metres = _pixels(data, np.dtype(f"{order}f4"), 1)[:, :, 0].astype(np.float32)
        return np.where(np.isfinite(metres), metres, np.float32(0.0))
    raise PlantError(f"an image encoded as `{encoding}` has no depths; known are 16UC1, 32FC1")


def _pixels(data: Data, dtype: np.dtype[Any], channels: int) -> Array:
    height, width, step = data["height"], data["width"], data["step"]
    row = width * channels * dtype.itemsize
    if step < row or len(data["data"]) < height * step:
        raise PlantError(
            f"an image of {height} times {width} pixels as `{data['encoding']}` has "
            f"{len(data['data'])} bytes in rows of {step}: they are too few"
        )
    rows = np.frombuffer(data["data"], np.uint8, height * step).reshape(height, step)
    return np.ascontiguousarray(rows[:, :row]).view(dtype).reshape(height, width, channels)


def _image(value: Array, encoding: str) -> dict[str, Any]:
    return {
        "height": value.shape[0],
        "width": value.shape[1],
        "encoding": encoding,
        "is_bigendian": 0,
        "step": value.strides[0],
        "data": value.tobytes(),
    }


def _written_depth(value: Array) -> dict[str, Any]:
    return _image(np.ascontiguousarray(value, np.dtype("<f4")), "32FC1")


def _written_rgb(value: Array) -> dict[str, Any]:
    return _image(np.ascontiguousarray(value), "rgb8")


def _names(value: Any) -> tuple[str, ...]:
    """The fields of a record; none if it is not one."""
    if is_dataclass(value):
        return tuple(field.name for field in fields(value))
    return getattr(value, "_fields", ())


def _sent(value: Any) -> Any:
    """A record as the fields of a message, which have the same names, and its values in them."""
    if names := _names(value):
        return {name: _sent(getattr(value, name)) for name in names}
    if isinstance(value, np.ndarray):
        return _SHAPES["pose"][1](value) if value.ndim > 1 else value.tolist()
    return list(map(_sent, value)) if isinstance(value, (list, tuple)) else value


def _only_sent(data: Any) -> Any:
    raise PlantError("records are only sent")


def _itself(value: Any) -> Any:
    return value


def _number_or_word(value: Any) -> Any:
    """A scalar; a duration is a number of seconds."""
    if isinstance(value, Mapping) and value.keys() == {"sec", "nanosec"}:
        return value["sec"] + value["nanosec"] * 1e-9
    return value


def _never(value: Any) -> Any:
    raise PlantError("cameras are not told what they are")


_SHAPES: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "arrival": (lambda message: True, lambda value: {}),
    "record": (_only_sent, _sent),
    "records": (_only_sent, _sent),
    "scalar": (_number_or_word, _itself),
    "vector": (lambda numbers: np.array(numbers, dtype=np.float64), lambda value: value.tolist()),
    "tuple": (tuple, list),
    "vector3": (lambda data: np.array(_axes(data)), _named),
    "pose": _pose("position", "orientation"),
    "transform": _pose("translation", "rotation"),
    "twist": _spatial("linear", "angular"),
    "wrench": _spatial("force", "torque"),
    "image": (_rgb, _written_rgb),
    "depth": (_depth, _written_depth),
    "camera": (lambda k: np.array([k[0], k[4], k[2], k[5]], dtype=np.float64), _never),
}
"""How each shape is read and written; `camera` are fx, fy, cx, cy of the matrix K, in pixels;
`arrival` is a message without fields, and a `record` has the fields of one by their names. Those
that name joints, `joints` and `trajectory`, are above."""
