"""Reads MJCF files: names, with those of the models that they include and attach.

Only these are read; whether MuJoCo takes the model shows when it runs. A document type is refused:
MJCF has none, and entities can make a short file endless.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from math import radians
from xml.parsers import expat

from specc.mjcf.actuator_names import ActuatorNames
from specc.mjcf.assets import Assets
from specc.mjcf.defaults import Defaults
from specc.mjcf.model import Model, ModelError, ModelFiles, ModelObject, ModelPart
from specc.mjcf.sizes import MOST_BYTES, MOST_ELEMENTS, copies, digits, excess, number, step_s
from specc.reachable import reachable
from specc.read import ANYWHERE, AllowedPaths
from specc.refusal import reason_of
from specc.source import real_path

MAX_BYTES = 10_000_000
"""Of a model with what it includes."""
_MOST_FILES = 100
_DEEPEST = 200
_MOST_NAMES = 20_000
_MOST_LETTERS = 2_000_000
"""That attachments copy, and letters of these."""
_MOST_PLACES = 20_000

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


_DRIVES = "actuator"
_DEPTH_OF_DRIVE = 3
"""How many elements are open in one: `<mujoco><actuator><motor>`."""

_FROM_URDF = (
    "let MuJoCo write it as MJCF and add drives, as docs/your_robot.md shows under `From URDF`"
)
_MOST = f"{MOST_ELEMENTS:,} elements"


def read_model(path: str, reach: AllowedPaths = ANYWHERE) -> Model:
    """The names in the MJCF file at `path` and in those that it includes, inside `reach`.

    Raises:
        ModelError: a file is missing, unreadable, too large, not XML, or not MJCF, or the model
            names one outside.
    """
    reader = _ModelReader(path, reach)
    model = reader.read_whole(path)
    model.files, model.missing = reader.files_of(path)
    return model


class _ModelReader:
    def __init__(self, path: str, reach: AllowedPaths) -> None:
        self._model = Model()
        self._assets = Assets()
        self._base = os.path.dirname(path)
        self._reach = reach
        self._attached: list[tuple[str, str]] = []
        self._times = [1]
        """How many copies are made of what stands in each open element, and outside of all."""
        self._copied = self._letters = 0
        self._weight = 0
        self._places = 0
        self._models: dict[str, Model] = {}
        self._files: list[str] = []
        self._open: list[str] = []
        self._classes = [""]
        """The class of defaults inside each open element, and outside of all."""
        self._compiler: dict[str, str] = {}
        self._clamps = True
        """Whether controls are cut to their ranges."""
        self._defaults = Defaults()
        self._elements: list[tuple[str, str, str, dict[str, str]]] = []
        """Section, tag, class and attributes of all that have names, and of all actuators."""
        self._bytes = 0
        self._root = "mujoco"
        self._texts: set[str] = set()
        self._weighed: set[str] = set()
        self._named_by: dict[str, tuple[str, Assets]] = {}
        """Real path of a model -> its folder, and the files that it names."""
        self._attachments: dict[str, set[str]] = {}
        """Real path of a model -> those that it attaches."""

    def files_of(self, path: str) -> tuple[ModelFiles, tuple[str, ...]]:
        """The files of a model with what it attaches, and what of them is not there, in words."""
        attached = reachable([real_path(path)], lambda real: self._attachments.get(real, ()))
        assets: dict[tuple[str, ...], None] = {}
        missing: dict[str, None] = {}
        unused: dict[str, None] = {}
        for real, (base, named) in self._named_by.items():
            if real in attached:
                assets |= dict.fromkeys(named.there(base))
                missing |= dict.fromkeys(named.missing(base))
            else:  # MuJoCo reads its text and goes no further
                unused |= dict.fromkeys(place for places in named.there(base) for place in places)
            unused |= dict.fromkeys(named.unopened(base))
        texts = tuple(sorted(self._texts))
        return ModelFiles(texts, tuple(sorted(assets)), tuple(sorted(unused))), tuple(missing)

    def read_whole(self, path: str) -> Model:
        """A model with those that it attaches; all files that they name must lie inside."""
        model, assets, base = Model(), Assets(), os.path.dirname(path)
        attached: list[tuple[str, str]] = []
        self._model, self._assets, self._base, self._attached = model, assets, base, attached
        self._defaults, self._elements, self._compiler = Defaults(), [], {}
        self._clamps = True
        self.read(path)
        self._elements.sort(key=lambda each: each[0] == _DRIVES)
        unnamed = ActuatorNames(e[3].get("name", "") for e in self._elements if e[0] == _DRIVES)
        for section, tag, class_, given in self._elements:
            whole = self._defaults.applied(class_, tag, given)
            if name := given.get("name") or unnamed.of(whole):
                self._take(section, tag, name, whole)
        for asset, is_opened in assets.paths(base):
            self._places += 1
            if self._places > _MOST_PLACES:
                shown = os.path.basename(path)
                raise ModelError(f"files of {shown} may be at more than {_MOST_PLACES:,} places")
            if is_opened:
                self._confine(asset)
                self._weigh(asset)
        real = real_path(path)
        self._named_by[real] = base, assets
        others = self._others(assets.models(base))
        for name, prefix in dict.fromkeys(attached):
            if name in others:
                other = self._models[others[name]]
                self._count(path, model, other, prefix)
                model.attach(other, prefix)
                self._attachments.setdefault(real, set()).add(others[name])
            else:
                model.complete = False
        self._models[real] = model
        return model

    def _count(self, path: str, model: Model, other: Model, prefix: str) -> None:
        """Count what is about to be copied."""
        self._copied += len(other) + 1
        self._letters += len(other) * len(prefix) + other.letters
        model.size += other.size
        shown = os.path.basename(path)
        if self._copied > _MOST_NAMES:
            raise ModelError(f"what {shown} attaches has more than {_MOST_NAMES:,} names")
        if self._letters > _MOST_LETTERS:
            raise ModelError(f"what {shown} attaches has names of over {_MOST_LETTERS:,} letters")
        if model.size > MOST_ELEMENTS:
            raise ModelError(f"with what it attaches {shown} has more than {_MOST}")

    def _others(self, named: Iterable[tuple[str, str]]) -> dict[str, str]:
        """Name -> real path of the models that can be attached; one being read attaches itself."""
        found: dict[str, str] = {}
        for name, path in named:
            real = real_path(path)
            if os.path.isfile(path) and real not in self._files:
                self.read_whole(path)
            other = self._models.get(real)
            if other is not None:
                found[name or other.name] = real
        return found

    def _weigh(self, asset: str) -> None:
        """Count the bytes of a file that only the simulator reads."""
        if asset not in self._weighed and os.path.isfile(asset):
            self._weighed.add(asset)
            self._weight += os.path.getsize(asset)
            if self._weight > MOST_BYTES:
                shown = os.path.basename(asset)
                raise ModelError(f"with {shown} its files have more than {MOST_BYTES:,} bytes")

    def _confine(self, path: str) -> None:
        if not self._reach.contains(path):
            shown = os.path.basename(path)
            raise ModelError(f"{shown} lies outside the project; {self._reach.hint_to_allow(path)}")

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
        self._texts.add(path)
        depth = len(self._open)

        def start(tag: str, attributes: dict[str, str]) -> None:
            is_root = len(self._open) == depth
            if is_root and tag == "robot":
                raise ModelError(f"{shown} is URDF; {_FROM_URDF}")
            if is_root and tag not in ("mujoco", "mujocoinclude"):
                raise ModelError(f"the root of {shown} is not <mujoco>")
            self._start(self._root if is_root else tag, attributes)
            if why := self._measure(tag, attributes):
                raise ModelError(f"{shown}, line {parser.CurrentLineNumber}: {why}")

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
        except (LookupError, ValueError):  # of codecs of Python, which the text names
            raise ModelError(
                f"the encoding that {shown} names cannot be read: save it as UTF-8, which MuJoCo "
                "takes it for"
            ) from None

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self._open) >= _DEEPEST:
            raise ModelError(f"elements are nested more than {_DEEPEST} deep")
        self._open.append(tag)
        section = self._open[1] if len(self._open) > 2 else ""
        in_defaults, around = section == "default", self._classes[-1]
        self._classes.append(self._defaults.entered(tag, attributes, around, inside=in_defaults))
        self._assets.take(tag, attributes)
        if len(self._open) == 1:
            self._model.name = attributes.get("model", "")
        if tag == "include" and "file" in attributes:
            self._include(attributes["file"])
        elif tag == "attach":
            self._attached.append((attributes.get("model", ""), attributes.get("prefix", "")))
        elif tag == "compiler":
            self._compiler |= attributes
        elif tag == "option" and len(self._open) == 2 and "timestep" in attributes:
            self._model.timestep_s = step_s(attributes["timestep"])
        elif tag == "flag" and "clampctrl" in attributes:
            self._clamps = attributes["clampctrl"] != "disable"
        elif tag in _GENERATING:
            self._model.complete = False
        elif in_defaults:
            self._defaults.set(around, tag, attributes)
        elif section and (attributes.get("name") or self._is_actuator(section)):
            self._elements.append((section, tag, attributes.get("class", around), attributes))

    def _is_actuator(self, section: str) -> bool:
        """Whether the element that has just begun is an actuator, not a part of one."""
        return section == _DRIVES and len(self._open) == _DEPTH_OF_DRIVE

    def _measure(self, tag: str, attributes: dict[str, str]) -> str:
        """Count an element with its copies; what is too much of it."""
        self._times.append(self._times[-1] * copies(tag, attributes))
        self._model.size += self._times[-1]
        if self._model.size > MOST_ELEMENTS:
            return f"with the copies of this the model has more than {_MOST}"
        return excess(tag, attributes)

    def _end(self, _: str) -> None:
        self._open.pop()
        self._classes.pop()
        self._times.pop()

    def _include(self, file: str) -> None:
        # What is included takes the place of the element, so its root stands for the parent.
        around, root = self._open, self._root
        self._open, self._root = around[:-2], around[-2]
        self.read(os.path.join(self._base, file))
        self._open, self._root = around, root

    def _take(self, section: str, tag: str, name: str, attributes: dict[str, str]) -> None:
        model = self._model
        if section == _DRIVES:
            model.actuators[name] = 1
            model.parts[section, name] = self._actuator(tag, attributes)
        elif section == "sensor":
            model.sensors[name] = _sensor_size(tag, attributes)
            joint, actuator = attributes.get("joint", ""), attributes.get("actuator", "")
            cutoff = _is_other(attributes.get("cutoff", ""), 0.0)
            object_, reference = (_object(attributes, each) for each in ("obj", "ref"))
            model.parts[section, name] = ModelPart(
                tag, joint, actuator, object_, reference, cutoff=cutoff
            )
        elif section == "worldbody" and tag in ("joint", "freejoint"):
            kind = "free" if tag == "freejoint" else attributes.get("type", "hinge")
            model.joints[name] = _JOINT_SIZES.get(kind)
            model.parts["joint", name] = ModelPart(
                kind, range=_limits(kind, attributes, self._compiler)
            )
        elif section == "worldbody" and tag == "body":
            model.bodies.add(name)
        elif section == "worldbody" and tag == "camera":
            model.cameras[name] = _resolution(attributes.get("resolution", ""))

    def _actuator(self, tag: str, attributes: Mapping[str, str]) -> ModelPart:
        """What is known of it; joints are read before actuators, wherever they stand."""
        joint = attributes.get("joint", "")
        geared = _is_other(attributes.get("gear", ""), 1.0)
        control, force = (_range(attributes, of, self._compiler) for of in ("ctrl", "force"))
        inherited = number(attributes.get("inheritrange", "")) if tag == "position" else None
        if control is None and inherited and (reach := self._model.joint_range(joint)):
            middle, half = (reach[0] + reach[1]) / 2, (reach[1] - reach[0]) / 2 * inherited
            control = middle - half, middle + half
        if not self._clamps:
            control = None
        return ModelPart(tag, joint, geared=geared, control_range=control, force_range=force)


def _content(path: str, shown: str) -> bytes:
    try:
        # A pipe would block in open() and a device may never end.
        if os.path.exists(path) and not os.path.isdir(path) and not os.path.isfile(path):
            raise ModelError(f"{shown} is not a regular file")
        with open(path, "rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ModelError(f"{shown} cannot be read: {reason_of(error)}") from None
    except ValueError:
        raise ModelError(f"{shown} is not the name of a file") from None
    if len(content) > MAX_BYTES:
        raise _too_large(shown)
    return content


def _sensor_size(tag: str, attributes: dict[str, str]) -> int | None:
    if tag == "rangefinder" and ("data" in attributes or "camera" in attributes):
        return None
    if tag == "user":
        return digits(attributes.get("dim", "")) or None
    return _SIZE_OF_SENSOR.get(tag)


def _limits(
    kind: str, attributes: Mapping[str, str], compiler: Mapping[str, str]
) -> tuple[float, float] | None:
    """The range of a hinge or a slide, rad or m, if it is limited."""
    found = _range(attributes, "", compiler) if kind in ("hinge", "slide") else None
    if found and kind == "hinge" and compiler.get("angle", "degree") == "degree":
        return radians(found[0]), radians(found[1])
    return found


def _range(
    attributes: Mapping[str, str], of: str, compiler: Mapping[str, str]
) -> tuple[float, float] | None:
    """A range of the attributes `ctrlrange` and `ctrllimited`, say, if it limits anything."""
    limited = attributes.get(f"{of}limited", "auto")
    if limited == "auto":
        limited = compiler.get("autolimits", "true")
    try:
        least, greatest = map(float, attributes.get(f"{of}range", "").split())
    except ValueError:
        return None
    return (least, greatest) if limited == "true" and least < greatest else None


def _object(attributes: Mapping[str, str], of: str) -> ModelObject | None:
    name = attributes.get(f"{of}name", "")
    return (attributes.get(f"{of}type", ""), name) if name else None


def _is_other(text: str, usual: float) -> bool:
    """Whether an attribute begins with another number than the usual one."""
    return any(number(first) != usual for first in text.split()[:1])


def _resolution(text: str) -> tuple[int, int] | None:
    numbers = [digits(each) for each in text.split()]
    return (numbers[0], numbers[1]) if len(numbers) == 2 and all(numbers) else None


def _too_large(shown: str) -> ModelError:
    return ModelError(f"with {shown} the model is larger than {MAX_BYTES // 1_000_000} MB")
