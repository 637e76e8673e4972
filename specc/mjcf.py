"""What an MJCF file declares by name: joints, sensors, actuators and cameras, with their sizes.

Only names and sizes are read; whether MuJoCo takes the model shows when it runs. A document type
is refused: MJCF has none, and entities can make a short file endless.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from xml.parsers import expat

MAX_BYTES = 50_000_000
_MOST_FILES = 100
_DEEPEST = 200

# Elements that make further named things when MuJoCo compiles the model.
_GENERATING = frozenset(("attach", "composite", "flexcomp", "replicate"))
_JOINT_SIZES = {"hinge": 1, "slide": 1, "ball": 4, "free": 7}
_SENSOR_SIZES = {
    1: (
        "touch rangefinder jointpos jointvel tendonpos tendonvel actuatorpos actuatorvel "
        "actuatorfrc jointactuatorfrc tendonactuatorfrc jointlimitpos jointlimitvel "
        "jointlimitfrc tendonlimitpos tendonlimitvel tendonlimitfrc distance insidesite "
        "e_potential e_kinetic clock"
    ),
    2: "camprojection",
    3: (
        "accelerometer velocimeter gyro force torque magnetometer ballangvel framepos framexaxis "
        "frameyaxis framezaxis framelinvel frameangvel framelinacc frameangacc subtreecom "
        "subtreelinvel subtreeangmom normal"
    ),
    4: "ballquat framequat",
    6: "fromto",
}
_SIZE_OF_SENSOR = {tag: size for size, tags in _SENSOR_SIZES.items() for tag in tags.split()}


class ModelError(Exception):
    """A model file that cannot be used; the message says why."""


@dataclass(slots=True)
class Model:
    """Name -> size, in numbers; None where the file does not say."""

    joints: dict[str, int | None] = field(default_factory=dict)
    sensors: dict[str, int | None] = field(default_factory=dict)
    actuators: dict[str, int | None] = field(default_factory=dict)
    cameras: dict[str, tuple[int, int] | None] = field(default_factory=dict)
    """Width and height in pixels."""
    complete: bool = True
    """Whether no further names come into being when MuJoCo compiles the model."""


def read_model(path: str) -> Model:
    """The names in the MJCF file at `path` and in those that it includes.

    Raises:
        ModelError: a file is missing, unreadable, too large, not XML, or not MJCF.
    """
    model = Model()
    _Reader(model, os.path.dirname(path)).read(path)
    return model


class _Reader:
    def __init__(self, model: Model, base: str) -> None:
        self._model = model
        self._base = base
        self._files: list[str] = []
        self._open: list[str] = []
        self._root = "mujoco"

    def read(self, path: str) -> None:
        """Take in a file whose root stands for the element `self._root`."""
        shown = os.path.basename(path)
        if path in self._files or len(self._files) >= _MOST_FILES:
            raise ModelError(f"{shown} is included twice")
        self._files.append(path)
        depth = len(self._open)

        def start(tag: str, attributes: dict[str, str]) -> None:
            is_root = len(self._open) == depth
            if is_root and tag not in ("mujoco", "mujocoinclude"):
                raise ModelError(f"the root of {shown} is <{tag}>, not <mujoco>")
            self._start(self._root if is_root else tag, attributes)

        def refuse(*_: object) -> None:
            raise ModelError(f"{shown} declares a document type")

        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = refuse
        parser.StartElementHandler = start
        parser.EndElementHandler = self._end
        try:
            parser.Parse(_content(path, shown), True)
        except expat.ExpatError as error:
            reason = expat.errors.messages[error.code]
            raise ModelError(f"{shown} is not XML: {reason}, line {error.lineno}") from None

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self._open) >= _DEEPEST:
            raise ModelError(f"elements are nested more than {_DEEPEST} deep")
        self._open.append(tag)
        section = self._open[1] if len(self._open) > 2 else ""
        if tag == "include" and "file" in attributes:
            self._include(attributes["file"])
        elif tag in _GENERATING:
            self._model.complete = False
        elif section and (name := attributes.get("name")):
            self._take(section, tag, name, attributes)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _include(self, file: str) -> None:
        # What is included takes the place of the element, so its root stands for the parent.
        around, root = self._open, self._root
        self._open, self._root = around[:-2], around[-2]
        self.read(os.path.join(self._base, file))
        self._open, self._root = around, root

    def _take(self, section: str, tag: str, name: str, attributes: dict[str, str]) -> None:
        model = self._model
        if section == "actuator":
            model.actuators[name] = 1
        elif section == "sensor":
            model.sensors[name] = _sensor_size(tag, attributes)
        elif section == "worldbody" and tag in ("joint", "freejoint"):
            kind = "free" if tag == "freejoint" else attributes.get("type", "hinge")
            model.joints[name] = _JOINT_SIZES.get(kind)
        elif section == "worldbody" and tag == "camera":
            model.cameras[name] = _resolution(attributes.get("resolution", ""))


def _content(path: str, shown: str) -> bytes:
    try:
        # A pipe would block in open() and a device may never end.
        if os.path.exists(path) and not os.path.isdir(path) and not os.path.isfile(path):
            raise ModelError(f"{shown} is not a regular file")
        with open(path, "rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        reason = (error.strerror or "unknown reason").lower()
        raise ModelError(f"{shown} cannot be read: {reason}") from None
    except ValueError:
        raise ModelError(f"{shown} is not the name of a file") from None
    if len(content) > MAX_BYTES:
        raise ModelError(f"{shown} is larger than {MAX_BYTES // 1_000_000} MB")
    return content


def _sensor_size(tag: str, attributes: dict[str, str]) -> int | None:
    if tag == "rangefinder" and ("data" in attributes or "camera" in attributes):
        return None
    if tag == "user" and attributes.get("dim", "").isdigit():
        return int(attributes["dim"])
    return _SIZE_OF_SENSOR.get(tag)


def _resolution(text: str) -> tuple[int, int] | None:
    numbers = text.split()
    if len(numbers) != 2 or not all(n.isdigit() for n in numbers):
        return None
    return int(numbers[0]), int(numbers[1])
