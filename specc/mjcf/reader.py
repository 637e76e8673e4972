"""Reads MJCF files: names, with those of the models that they include and attach.

Only these are read; whether MuJoCo takes the model shows when it runs. A document type is refused:
MJCF has none, and entities can make a short file endless.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import radians
from xml.parsers import expat

from specc.mjcf.model import Model, ModelError, ModelFiles, ModelPart
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


_ACTUATOR = "actuator"
_ACTUATOR_DEPTH = 3
"""How many elements are open in one: `<mujoco><actuator><motor>`; those below are its parts."""

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
    reader = _ModelReader(reach)
    model = reader.read_model(path)
    model.files, model.missing = reader.files_of(path)
    return model


# What actuators without a name are called.


_ACTED_ON = ("joint", "jointinparent", "tendon", "cranksite", "site", "body")
"""Attributes of an actuator that name the part it acts on."""


class ActuatorNames:
    """Names for the actuators of one file that have none, as in the simulator.

    An actuator is called after the part that it acts on. Where an actuator has that name, `_2`,
    `_3` and so on follows.
    """

    def __init__(self, named: Iterable[str]) -> None:
        self._used_names = set(named)
        self._last: dict[str, int] = {}
        """The number of the last one that acts on a part."""

    def of(self, attributes: Mapping[str, str]) -> str:
        """A new name for an unnamed actuator, by the part it acts on; empty if none is given."""
        part = next((attributes[key] for key in _ACTED_ON if attributes.get(key)), "")
        if not part:
            return ""
        number = self._last.get(part, 0) + 1
        while (name := part if number == 1 else f"{part}_{number}") in self._used_names:
            number += 1
        self._last[part] = number
        self._used_names.add(name)
        return name


# Classes of defaults. The outermost class holds for every element without another one, and a class
# has what the one around it has. An element belongs to its own `class`, else to the `childclass` of
# the nearest body or frame.


_OUTERMOST = ""
_READ = (
    "actuator camera class ctrllimited ctrlrange cutoff data dim forcelimited forcerange gear "
    "inheritrange joint limited range resolution type"
)
"""Attributes that the compiler reads; a class may set any number of others."""
_ACTUATORS = "general motor position velocity intvelocity damper cylinder muscle adhesion plugin"


class Defaults:
    """What elements have by their classes, once the whole model is read."""

    def __init__(self) -> None:
        self._own: dict[tuple[str, str], dict[str, str]] = {}
        """Class and kind of element -> attributes that the class sets."""
        self._outer: dict[str, str] = {}
        self._inherited: dict[tuple[str, str], dict[str, str]] = {}
        """What classes have with those around them; computed once."""

    def class_inside(
        self, tag: str, attributes: Mapping[str, str], around: str, in_defaults: bool
    ) -> str:
        """The class that holds inside an element, where another one holds around it."""
        if tag != "default":
            return attributes.get("childclass", around)
        if not in_defaults:
            self._outer.setdefault(attributes.get("class", "main"), _OUTERMOST)
            return _OUTERMOST
        name = attributes.get("class", around)
        if name != around:
            self._outer.setdefault(name, around)
        return name

    def set(self, name: str, tag: str, attributes: Mapping[str, str]) -> None:
        """Set default attributes of one kind of element in a class."""
        own = self._own.setdefault((name, _kind(tag)), {})
        own |= {key: value for key, value in attributes.items() if key in _READ.split()}

    def attributes_of(self, name: str, tag: str, attributes: Mapping[str, str]) -> dict[str, str]:
        """The attributes of an element with those of its class."""
        kind = _kind(tag)
        if (name, kind) not in self._inherited:
            found: dict[str, str] = {}
            outer = name
            for _ in range(len(self._outer) + 1):
                found = {**self._own.get((outer, kind), {}), **found}
                if outer == _OUTERMOST:
                    break
                outer = self._outer.get(outer, _OUTERMOST)
            self._inherited[name, kind] = found
        return {**self._inherited[name, kind], **attributes}


def _kind(tag: str) -> str:
    """Actuators of all kinds share what a class sets."""
    return "actuator" if tag in _ACTUATORS.split() else tag


# Files that a model names beside those that it includes.


_FACES = ("fileright", "fileleft", "fileup", "filedown", "filefront", "fileback")
_FILLED = ("mesh", "gmsh")
"""Types of `<flexcomp>` that come from a file; the others count points."""
_KINDS = {"hfield": "height field"} | {tag: tag for tag in ("mesh", "model", "skin", "texture")}


@dataclass(eq=False, slots=True)
class Assets:
    """Meshes, height fields, textures, skins and models, and the folders where they are.

    MuJoCo looks for a file in one folder, which depends on its version where sections contradict
    one another; every folder that may be meant counts. Attributes that MuJoCo does not look at, as
    the file of a texture that it draws itself, name nothing that the model uses.
    """

    _files: dict[tuple[str, str, bool], None] = field(default_factory=dict)
    """Tag, file, and whether MuJoCo opens it."""
    _models: list[tuple[str, str]] = field(default_factory=list)
    _folders: dict[str, set[str]] = field(default_factory=dict)
    _stripped: bool = False

    def add(self, tag: str, attributes: Mapping[str, str]) -> None:
        """Add the files or folders that an element names."""
        if tag == "compiler":
            for name in ("assetdir", "meshdir", "texturedir"):
                if name in attributes:
                    self._folders.setdefault(name, set()).add(attributes[name])
            self._stripped |= attributes.get("strippath") == "true"
        elif tag != "include":
            opened = _file_attributes(tag, attributes)
            for name, value in attributes.items():
                if value and name.startswith("file"):
                    self._files[tag, value, name in opened] = None
            if tag == "model":
                self._models.append((attributes.get("name", ""), attributes.get("file", "")))

    def paths(self, base: str) -> Iterator[tuple[str, bool]]:
        """Yield the possible paths of files, and whether MuJoCo opens them.

        `base` is the folder of the model's text.
        """
        for tag, file, is_opened in sorted(self._files, key=lambda each: not each[2]):
            yield from ((path, is_opened) for path in self._possible_paths(base, tag, file))

    def existing(self, base: str) -> list[tuple[str, ...]]:
        """For each opened file, those of its possible paths that exist.

        Files without any are left out.
        """
        candidates = [
            self._possible_paths(base, tag, file) for tag, file, opened in self._files if opened
        ]
        return [found for each in candidates if (found := tuple(filter(os.path.isfile, each)))]

    def unopened(self, base: str) -> Iterator[str]:
        """Yield existing files that are named where MuJoCo does not look."""
        for tag, file, is_opened in self._files:
            if not is_opened:
                yield from filter(os.path.isfile, self._possible_paths(base, tag, file))

    def missing(self, base: str) -> Iterator[str]:
        """Yield a phrase for each file that is at none of its possible paths."""
        for tag, file, is_opened in self._files:
            if is_opened and not any(map(os.path.isfile, self._possible_paths(base, tag, file))):
                yield f"the {_KINDS.get(tag, 'file')} {file}"

    def models(self, base: str) -> Iterator[tuple[str, str]]:
        """Yield the models to attach: a name, which may be empty, and a possible path."""
        for name, file in self._models:
            yield from ((name, path) for path in self._possible_paths(base, "model", file))

    def _possible_paths(self, base: str, tag: str, file: str) -> list[str]:
        name = os.path.basename(file) if self._stripped else file
        own = self._folders.get("texturedir" if tag == "texture" else "meshdir", set())
        folders = own | self._folders.get("assetdir", set())
        if tag not in ("mesh", "hfield", "texture") or not folders:
            folders = folders | {""}
        return [os.path.join(base, folder, name) for folder in sorted(folders)]


def _file_attributes(tag: str, attributes: Mapping[str, str]) -> Collection[str]:
    """The attributes of an element that name a file which MuJoCo opens."""
    if tag == "flexcomp":
        return ("file",) if attributes.get("type") in _FILLED else ()
    if tag not in _KINDS or attributes.get("builtin", "none") != "none":
        return ()
    return _FACES if tag == "texture" and not attributes.get("file") else ("file",)


# Models.


@dataclass(eq=False, slots=True)
class _ModelText:
    """What the texts of one model declare, with those that it includes."""

    base: str
    model: Model = field(default_factory=Model)
    assets: Assets = field(default_factory=Assets)
    attached: dict[tuple[str, str], None] = field(default_factory=dict)
    """Names of models, and prefixes."""
    attachments: set[str] = field(default_factory=set)
    """Real paths of the models that it attaches."""
    defaults: Defaults = field(default_factory=Defaults)
    elements: list[tuple[str, str, str, dict[str, str]]] = field(default_factory=list)
    """Section, tag, class and attributes of all that have names, and of all actuators."""
    compiler: dict[str, str] = field(default_factory=dict)
    clamps: bool = True
    """Whether controls are cut to their ranges."""
    root: str = "mujoco"
    """The element that the root of the file stands for."""
    tags: list[str] = field(default_factory=list)
    """Of the open elements."""
    classes: list[str] = field(default_factory=lambda: [""])
    """The class of defaults inside each open element, and outside of all."""
    copies: list[int] = field(default_factory=lambda: [1])
    """How many copies are made of what stands in each open element, and outside of all."""

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        """Handle the start of an element."""
        if len(self.tags) >= _DEEPEST:
            raise ModelError(f"elements are nested more than {_DEEPEST} deep")
        self.tags.append(tag)
        depth, section = len(self.tags), self.tags[1] if len(self.tags) > 2 else ""
        in_defaults, around = section == "default", self.classes[-1]
        self.classes.append(self.defaults.class_inside(tag, attributes, around, in_defaults))
        self.assets.add(tag, attributes)
        if depth == 1:
            self.model.name = attributes.get("model", "")
        if tag == "include" and "file" in attributes:
            return
        if tag == "attach":
            self.attached[attributes.get("model", ""), attributes.get("prefix", "")] = None
        elif tag == "compiler":
            self.compiler |= attributes
        elif tag == "option" and depth == 2 and "timestep" in attributes:
            self.model.timestep_s = step_s(attributes["timestep"])
        elif tag == "flag" and "clampctrl" in attributes:
            self.clamps = attributes["clampctrl"] != "disable"
        elif tag in _GENERATING:
            self.model.complete = False
        elif in_defaults:
            self.defaults.set(around, tag, attributes)
        elif section and (
            attributes.get("name") or (section, depth) == (_ACTUATOR, _ACTUATOR_DEPTH)
        ):
            self.elements.append((section, tag, attributes.get("class", around), attributes))

    def count(self, tag: str, attributes: dict[str, str]) -> str:
        """Count an element with its copies; returns why it exceeds a bound, or an empty text."""
        self.copies.append(self.copies[-1] * copies(tag, attributes))
        self.model.size += self.copies[-1]
        if self.model.size > MOST_ELEMENTS:
            return f"with the copies of this the model has more than {_MOST}"
        return excess(tag, attributes)

    def end(self, _: str) -> None:
        """Handle its end."""
        self.tags.pop()
        self.classes.pop()
        self.copies.pop()

    def finish(self) -> None:
        """Add all elements to the model: joints before actuators, wherever they stand."""
        self.elements.sort(key=lambda each: each[0] == _ACTUATOR)
        unnamed = ActuatorNames(e[3].get("name", "") for e in self.elements if e[0] == _ACTUATOR)
        for section, tag, class_, own in self.elements:
            attributes = self.defaults.attributes_of(class_, tag, own)
            if name := own.get("name") or unnamed.of(attributes):
                self._add(section, tag, name, attributes)

    def _add(self, section: str, tag: str, name: str, attributes: dict[str, str]) -> None:
        model = self.model
        if section == _ACTUATOR:
            model.actuators[name] = 1
            model.parts[section, name] = self._actuator(tag, attributes)
        elif section == "sensor":
            model.sensors[name] = _sensor_size(tag, attributes)
            joint, actuator = attributes.get("joint", ""), attributes.get("actuator", "")
            cutoff = _is_other(attributes.get("cutoff", ""), 0.0)
            object_, reference = (
                (attributes.get(f"{of}type", ""), attributes[f"{of}name"])
                if attributes.get(f"{of}name")
                else None
                for of in ("obj", "ref")
            )
            model.parts[section, name] = ModelPart(
                tag, joint, actuator, object_, reference, cutoff=cutoff
            )
        elif section == "worldbody" and tag in ("joint", "freejoint"):
            kind = "free" if tag == "freejoint" else attributes.get("type", "hinge")
            limits = _range(attributes, "", self.compiler) if kind in ("hinge", "slide") else None
            if limits and kind == "hinge" and self.compiler.get("angle", "degree") == "degree":
                limits = radians(limits[0]), radians(limits[1])
            model.joints[name] = _JOINT_SIZES.get(kind)
            model.parts["joint", name] = ModelPart(kind, range=limits)
        elif section == "worldbody" and tag == "body":
            model.bodies.add(name)
        elif section == "worldbody" and tag == "camera":
            size = [digits(each) for each in attributes.get("resolution", "").split()]
            model.cameras[name] = (size[0], size[1]) if len(size) == 2 and all(size) else None

    def _actuator(self, tag: str, attributes: Mapping[str, str]) -> ModelPart:
        joint = attributes.get("joint", "")
        geared = _is_other(attributes.get("gear", ""), 1.0)
        control, force = (_range(attributes, of, self.compiler) for of in ("ctrl", "force"))
        inherited = number(attributes.get("inheritrange", "")) if tag == "position" else None
        if control is None and inherited and (limits := self.model.joint_range(joint)):
            middle, half = (limits[0] + limits[1]) / 2, (limits[1] - limits[0]) / 2 * inherited
            control = middle - half, middle + half
        if not self.clamps:
            control = None
        return ModelPart(tag, joint, geared=geared, control_range=control, force_range=force)


class _ModelReader:
    """Reads a model and those that it attaches, all of them within one set of bounds."""

    def __init__(self, reach: AllowedPaths) -> None:
        self._reach = reach
        self._models: dict[str, _ModelText] = {}
        """By real paths, in the order in which they are named."""
        self._complete: set[str] = set()
        self._files: set[str] = set()
        self._paths: set[str] = set()
        self._weighed: set[str] = set()
        self._bytes = self._weight = self._places = self._copied = self._letters = 0

    def files_of(self, path: str) -> tuple[ModelFiles, tuple[str, ...]]:
        """The files of a model and of those it attaches, and phrases for the missing ones."""
        attached = reachable([real_path(path)], lambda real: self._models[real].attachments)
        assets: set[tuple[str, ...]] = set()
        missing: dict[str, None] = {}
        unused: set[str] = set()
        for real, model_text in self._models.items():
            existing = model_text.assets.existing(model_text.base)
            if real in attached:
                assets.update(existing)
                missing |= dict.fromkeys(model_text.assets.missing(model_text.base))
            else:  # MuJoCo reads its text and goes no further
                unused.update(path for paths in existing for path in paths)
            unused.update(model_text.assets.unopened(model_text.base))
        texts = tuple(sorted(self._paths))
        return ModelFiles(texts, tuple(sorted(assets)), tuple(sorted(unused))), tuple(missing)

    def read_model(self, path: str) -> Model:
        """A model with those that it attaches; all files that they name must lie inside."""
        text, shown = _ModelText(os.path.dirname(path)), os.path.basename(path)
        self._read_file(path, text)
        text.finish()
        for asset, is_opened in text.assets.paths(text.base):
            self._places += 1
            if self._places > _MOST_PLACES:
                raise ModelError(f"files of {shown} may be at more than {_MOST_PLACES:,} places")
            if is_opened:
                self._refuse_outside(asset)
                self._weigh(asset)
        self._models[real_path(path)] = text
        attachable = self._read_attachable(text)
        for name, prefix in text.attached:
            if name in attachable:
                self._attach(shown, text.model, self._models[attachable[name]].model, prefix)
                text.attachments.add(attachable[name])
            else:
                text.model.complete = False
        self._complete.add(real_path(path))
        return text.model

    def _attach(self, shown: str, model: Model, other: Model, prefix: str) -> None:
        self._copied += len(other) + 1
        self._letters += len(other) * len(prefix) + other.letters
        model.size += other.size
        if self._copied > _MOST_NAMES:
            raise ModelError(f"what {shown} attaches has more than {_MOST_NAMES:,} names")
        if self._letters > _MOST_LETTERS:
            raise ModelError(f"what {shown} attaches has names of over {_MOST_LETTERS:,} letters")
        if model.size > MOST_ELEMENTS:
            raise ModelError(f"with what it attaches {shown} has more than {_MOST}")
        model.attach(other, prefix)

    def _read_attachable(self, model_text: _ModelText) -> dict[str, str]:
        """Name -> real path of the models that can be attached; one being read attaches itself."""
        found: dict[str, str] = {}
        for name, path in model_text.assets.models(model_text.base):
            real = real_path(path)
            if os.path.isfile(path) and real not in self._files:
                self.read_model(path)
            if real in self._complete:
                found[name or self._models[real].model.name] = real
        return found

    def _weigh(self, asset: str) -> None:
        """Count the bytes of a file that only the simulator reads."""
        if asset not in self._weighed and os.path.isfile(asset):
            self._weighed.add(asset)
            self._weight += os.path.getsize(asset)
            if self._weight > MOST_BYTES:
                shown = os.path.basename(asset)
                raise ModelError(f"with {shown} its files have more than {MOST_BYTES:,} bytes")

    def _refuse_outside(self, path: str) -> None:
        if not self._reach.contains(path):
            shown = os.path.basename(path)
            raise ModelError(f"{shown} lies outside the project; {self._reach.hint_to_allow(path)}")

    def _read_file(self, path: str, text: _ModelText) -> None:
        """Add a file to a model; its root stands for the element `text.root`."""
        shown, real = os.path.basename(path), real_path(path)
        if len(self._files) >= _MOST_FILES:
            raise ModelError(f"more than {_MOST_FILES} files are included")
        if real in self._files:
            raise ModelError(f"{shown} is included twice")
        self._refuse_outside(path)
        self._files.add(real)
        self._paths.add(path)
        depth = len(text.tags)

        def start(tag: str, attributes: dict[str, str]) -> None:
            is_root = len(text.tags) == depth
            if is_root and tag == "robot":
                raise ModelError(f"{shown} is URDF; {_FROM_URDF}")
            if is_root and tag not in ("mujoco", "mujocoinclude"):
                raise ModelError(f"the root of {shown} is not <mujoco>")
            tag_here = text.root if is_root else tag
            text.start(tag_here, attributes)
            if tag_here == "include" and "file" in attributes:
                # What is included takes the place of the element: its root stands for the parent.
                around, root = text.tags, text.root
                text.tags, text.root = around[:-2], around[-2]
                self._read_file(os.path.join(text.base, attributes["file"]), text)
                text.tags, text.root = around, root
            if why := text.count(tag, attributes):
                raise ModelError(f"{shown}, line {parser.CurrentLineNumber}: {why}")

        def refuse(*_: object) -> None:
            raise ModelError(f"{shown} declares a document type")

        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = refuse
        parser.StartElementHandler = start
        parser.EndElementHandler = text.end
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


def _is_other(text: str, usual: float) -> bool:
    """Whether an attribute begins with another number than the usual one."""
    return any(number(first) != usual for first in text.split()[:1])


def _too_large(shown: str) -> ModelError:
    return ModelError(f"with {shown} the model is larger than {MAX_BYTES // 1_000_000} MB")
