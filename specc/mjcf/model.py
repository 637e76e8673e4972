"""What an MJCF file declares by name: joints, sensors, actuators and cameras, with sizes and kinds.

Only these are read, from the models that it attaches too; whether MuJoCo takes the model shows when
it runs. A document type is refused: MJCF has none, and entities can make a short file endless.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import inf, radians
from xml.parsers import expat

from specc.frozen import frozen
from specc.mjcf.assets import Assets
from specc.read import ANYWHERE, Reach
from specc.source import real_path

MAX_BYTES = 10_000_000
"""Of a model with what it includes."""
_MOST_FILES = 100
_DEEPEST = 200
_MOST_NAMES = 100_000

# Elements that make further named things when MuJoCo compiles the model.
_GENERATING = frozenset(("composite", "flexcomp", "replicate"))
_JOINT_SIZES = {"hinge": 1, "slide": 1, "ball": 4, "free": 7}
# Numbers that a sensor gives; in which units is in `specc.analysis.plant`.
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


@frozen
class Part:
    """A joint, sensor or actuator; a name is empty, and `geared` is None, where the file leaves it.

    `kind` is the type of a joint (`hinge`, `slide`, `ball`, `free`) or a tag (`rangefinder`,
    `position`); `joint` or `actuator` is what a sensor measures or an actuator drives.
    """

    kind: str
    joint: str = ""
    actuator: str = ""
    geared: bool | None = None
    """Whether an actuator has another gear than 1."""
    cutoff: bool = False
    """Whether a sensor gives no more than a largest value."""
    range: str = ""
    limited: str = ""
    """Of a joint, as they are written."""


@dataclass(slots=True)
class Model:
    """Name -> size, in numbers; None where the file does not say.

    Of a model that is attached, all names count, whichever of its bodies the model takes.
    """

    joints: dict[str, int | None] = field(default_factory=dict)
    sensors: dict[str, int | None] = field(default_factory=dict)
    actuators: dict[str, int | None] = field(default_factory=dict)
    cameras: dict[str, tuple[int, int] | None] = field(default_factory=dict)
    """Width and height in pixels."""
    bodies: set[str] = field(default_factory=set)
    complete: bool = True
    """Whether no further names come into being when MuJoCo compiles the model."""
    parts: dict[tuple[str, str], Part] = field(default_factory=dict)
    """By `joint`, `sensor` or `actuator`, and name, as they are written."""
    compiler: dict[str, str] = field(default_factory=dict)
    """How MuJoCo reads the file: `angle`, `autolimits`."""
    defaults: set[str] = field(default_factory=set)
    """Attributes that some class of defaults sets for joints or actuators."""
    files: tuple[str, ...] = ()
    """Paths of the model itself and of all files there are that it names."""
    name: str = ""
    timestep_s: float | None = 0.002
    """How long a step of the simulation is; None where the file says nothing that it can be."""

    def __len__(self) -> int:
        """How many names there are."""
        return len(self.parts) + len(self.cameras) + len(self.bodies)

    def attach(self, other: Model, prefix: str) -> None:
        """Take in another model, with a prefix before all its names."""
        self.joints |= {prefix + name: size for name, size in other.joints.items()}
        self.sensors |= {prefix + name: size for name, size in other.sensors.items()}
        self.actuators |= {prefix + name: size for name, size in other.actuators.items()}
        self.cameras |= {prefix + name: size for name, size in other.cameras.items()}
        self.bodies |= {prefix + name for name in other.bodies}
        for (section, name), part in other.parts.items():
            joint, actuator = (name and prefix + name for name in (part.joint, part.actuator))
            range = part.range if other.compiler == self.compiler else ""
            self.parts[section, prefix + name] = replace(
                part, joint=joint, actuator=actuator, range=range
            )
        self.complete &= other.complete
        self.defaults |= other.defaults

    def joint_kind(self, name: str) -> str:
        """`hinge`, `slide`, `ball` or `free`; empty where that is not known."""
        part = self.parts.get(("joint", name))
        if part is None:
            return ""
        return part.kind or ("" if "type" in self.defaults else "hinge")

    def joint_range(self, name: str) -> tuple[float, float] | None:
        """From where to where a hinge or a slide goes, rad or m; None where that is not known."""
        part, kind = self.parts.get(("joint", name), Part("")), self.joint_kind(name)
        limited = part.limited or ("" if "limited" in self.defaults else "auto")
        if limited == "auto" and self.compiler.get("autolimits", "true") == "true":
            limited = "true"
        try:
            least, greatest = map(float, part.range.split())
        except ValueError:
            return None
        if limited != "true" or not least < greatest:
            return None
        if kind == "hinge" and self.compiler.get("angle", "degree") == "degree":
            return radians(least), radians(greatest)
        return (least, greatest) if kind in ("hinge", "slide") else None

    def driven(self, name: str, *, direct: bool = False) -> str:
        """The joint that an actuator drives, if `direct` with a gear of 1; empty if none."""
        part = self.parts.get(("actuator", name), Part(""))
        geared = part.geared or (part.geared is None and "gear" in self.defaults)
        return "" if direct and geared else part.joint


def read_model(path: str, reach: Reach = ANYWHERE) -> Model:
    """The names in the MJCF file at `path` and in those that it includes, inside `reach`.

    Raises:
        ModelError: a file is missing, unreadable, too large, not XML, or not MJCF, or the model
            names one outside.
    """
    reader = _Reader(path, reach)
    model = reader.read_whole(path)
    model.files = reader.found
    return model


class _Reader:
    def __init__(self, path: str, reach: Reach) -> None:
        self._model = Model()
        self._assets = Assets()
        self._base = os.path.dirname(path)
        self._reach = reach
        self._attached: list[tuple[str, str]] = []
        self._models: dict[str, Model] = {}
        self._files: list[str] = []
        self._open: list[str] = []
        self._bytes = 0
        self._root = "mujoco"
        self._named: set[str] = set()

    @property
    def found(self) -> tuple[str, ...]:
        """The files that were read, and those named in them that are there."""
        return tuple(sorted(filter(os.path.isfile, self._named)))

    def read_whole(self, path: str) -> Model:
        """A model with those that it attaches; all files that they name must lie inside."""
        model, assets, base = Model(), Assets(), os.path.dirname(path)
        attached: list[tuple[str, str]] = []
        self._model, self._assets, self._base, self._attached = model, assets, base, attached
        self.read(path)
        for asset in assets.paths(base):
            self._confine(asset)
            self._named.add(asset)
        others = self._others(assets.models(base))
        left = _MOST_NAMES
        for name, prefix in dict.fromkeys(attached):
            left -= len(others[name]) + 1 if name in others else 0
            if name in others and left >= 0:
                model.attach(others[name], prefix)
            else:
                model.complete = False
        self._models[real_path(path)] = model
        return model

    def _others(self, named: Iterable[tuple[str, str]]) -> dict[str, Model]:
        """The models that can be attached, by name; one that is being read attaches itself."""
        found: dict[str, Model] = {}
        for name, path in named:
            real = real_path(path)
            if os.path.isfile(path) and real not in self._files:
                self.read_whole(path)
            other = self._models.get(real)
            if other is not None:
                found[name or other.name] = other
        return found

    def _confine(self, path: str) -> None:
        if not self._reach.holds(path):
            shown = os.path.basename(path)
            raise ModelError(f"{shown} lies outside the project; {self._reach.way_in(path)}")

    def read(self, path: str) -> None:
        """Take in a file whose root stands for the element `self._root`."""
        shown = os.path.basename(path)
        if len(self._files) >= _MOST_FILES:
            raise ModelError(f"more than {_MOST_FILES} files are included")
        real = real_path(path)
        if real in self._files:
            raise ModelError(f"{shown} is included twice")
        self._confine(path)
        self._files.append(real)
        self._named.add(path)
        depth = len(self._open)

        def start(tag: str, attributes: dict[str, str]) -> None:
            is_root = len(self._open) == depth
            if is_root and tag not in ("mujoco", "mujocoinclude"):
                raise ModelError(f"the root of {shown} is not <mujoco>")
            self._start(self._root if is_root else tag, attributes)

        def refuse(*_: object) -> None:
            raise ModelError(f"{shown} declares a document type")

        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = refuse
        parser.StartElementHandler = start
        parser.EndElementHandler = self._end
        try:
            content = _content(path, shown)
            self._bytes += len(content)
            if self._bytes > MAX_BYTES:
                raise _too_large(shown)
            parser.Parse(content, True)
        except expat.ExpatError as error:
            reason = expat.errors.messages[error.code]
            raise ModelError(f"{shown} is not XML: {reason}, line {error.lineno}") from None

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self._open) >= _DEEPEST:
            raise ModelError(f"elements are nested more than {_DEEPEST} deep")
        self._open.append(tag)
        section = self._open[1] if len(self._open) > 2 else ""
        self._assets.take(tag, attributes)
        if len(self._open) == 1:
            self._model.name = attributes.get("model", "")
        if tag == "include" and "file" in attributes:
            self._include(attributes["file"])
        elif tag == "attach":
            self._attached.append((attributes.get("model", ""), attributes.get("prefix", "")))
        elif tag == "compiler":
            self._model.compiler |= attributes
        elif tag == "option" and len(self._open) == 2 and "timestep" in attributes:
            self._model.timestep_s = _length_s(attributes["timestep"])
        elif tag in _GENERATING:
            self._model.complete = False
        elif section == "default":
            inherited = {"gear", "type", "limited"} if tag == "joint" else {"gear"}
            self._model.defaults |= attributes.keys() & inherited
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
            geared = _is_other(attributes["gear"], 1.0) if "gear" in attributes else None
            model.parts[section, name] = Part(tag, attributes.get("joint", ""), "", geared)
        elif section == "sensor":
            model.sensors[name] = _sensor_size(tag, attributes)
            joint, actuator = attributes.get("joint", ""), attributes.get("actuator", "")
            cutoff = _is_other(attributes.get("cutoff", ""), 0.0)
            model.parts[section, name] = Part(tag, joint, actuator, cutoff=cutoff)
        elif section == "worldbody" and tag in ("joint", "freejoint"):
            kind = "free" if tag == "freejoint" else attributes.get("type", "")
            model.joints[name] = _JOINT_SIZES.get(kind or "hinge")
            limits = attributes.get("range", ""), attributes.get("limited", "")
            model.parts["joint", name] = Part(kind, range=limits[0], limited=limits[1])
        elif section == "worldbody" and tag == "body":
            model.bodies.add(name)
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
        raise _too_large(shown)
    return content


def _sensor_size(tag: str, attributes: dict[str, str]) -> int | None:
    if tag == "rangefinder" and ("data" in attributes or "camera" in attributes):
        return None
    if tag == "user" and attributes.get("dim", "").isdigit():
        return int(attributes["dim"])
    return _SIZE_OF_SENSOR.get(tag)


def _is_other(text: str, usual: float) -> bool:
    """Whether an attribute begins with another number than the usual one."""
    try:
        return float((text.split() or [str(usual)])[0]) != usual
    except ValueError:
        return True


def _length_s(text: str) -> float | None:
    try:
        length_s = float(text)
    except ValueError:
        return None
    return length_s if 0 < length_s < inf else None


def _resolution(text: str) -> tuple[int, int] | None:
    numbers = text.split()
    if len(numbers) != 2 or not all(n.isdigit() for n in numbers):
        return None
    return int(numbers[0]), int(numbers[1])


def _too_large(shown: str) -> ModelError:
    return ModelError(f"with {shown} the model is larger than {MAX_BYTES // 1_000_000} MB")
