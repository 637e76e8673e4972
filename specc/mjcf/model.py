"""What an MJCF file declares by name: joints, sensors, actuators, cameras, with sizes and kinds."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import dataclass, field, replace

from specc.refusal import Refused


class ModelError(Refused):
    """A model file that cannot be used; the message says why."""


ModelObject = tuple[str, str]
"""Kind and name of what a sensor is attached to."""


@dataclass(frozen=True, slots=True)
class ModelPart:
    """A joint, sensor or actuator, with what its class of defaults says; a name may be empty.

    `kind` is the type of a joint (`hinge`, `slide`, `ball`, `free`) or a tag (`rangefinder`,
    `position`); `joint` or `actuator` is what a sensor measures or an actuator drives. A sensor
    of a frame measures `object` as `reference` sees it, each a kind and a name: `("site", "tip")`.
    """

    kind: str
    joint: str = ""
    actuator: str = ""
    object: ModelObject | None = None
    reference: ModelObject | None = None
    """None for the world."""
    geared: bool = False
    """Whether an actuator has another gear than 1."""
    cutoff: bool = False
    """Whether the values of a sensor are limited."""
    range: tuple[float, float] | None = None
    """Limits of a hinge or a slide, rad or m; None if it has none."""
    control_range: tuple[float, float] | None = None
    """Limits of the controls of an actuator; None if they have none."""
    force_range: tuple[float, float] | None = None
    """Limits of the forces of an actuator."""


@dataclass(frozen=True, slots=True)
class ModelFiles:
    """Paths of the files that a model is made of."""

    texts: tuple[str, ...] = ()
    """MJCF: the model itself, and what it includes and attaches."""
    assets: tuple[tuple[str, ...], ...] = ()
    """Meshes and the like; of each one the possible paths that exist."""
    unused: tuple[str, ...] = ()
    """Files that are there and named in the texts, but that MuJoCo does not open."""

    @property
    def possible(self) -> tuple[str, ...]:
        """All places where a file may be."""
        return (*self.texts, *(path for paths in self.assets for path in paths))

    def used(self, opened: Collection[str]) -> tuple[str, ...]:
        """The files that the model uses.

        The files that MuJoCo `opened` decide between several possible paths.

        Raises:
            ModelError: a file is at several places, and it is not known which one is meant.
        """
        real = set(map(os.path.realpath, opened)) - set(map(os.path.realpath, self.unused))
        chosen: list[str] = []
        for paths in self.assets:
            if len(paths) > 1:
                matching = [path for path in paths if os.path.realpath(path) in real]
                if not matching:
                    raise ModelError(f"{paths[0]} may be {paths[1]} as well: name one folder")
                paths = (matching[0],)
            chosen += paths
        return (*self.texts, *dict.fromkeys(chosen))


@dataclass(slots=True)
class Model:
    """What an MJCF model declares.

    Joints, sensors and actuators map a name to its count of numbers, None if the file does not say.

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
    parts: dict[tuple[str, str], ModelPart] = field(default_factory=dict)
    """By `joint`, `sensor` or `actuator`, and name, as they are written."""
    files: ModelFiles = field(default_factory=ModelFiles)
    missing: tuple[str, ...] = ()
    """Files that it or an attached model names and that do not exist: `the mesh arm.obj`."""
    name: str = ""
    timestep_s: float | None = 0.002
    """The duration of a step of the simulation; None where the file has no valid one."""

    size: int = field(default=0, compare=False)
    """How many elements it has with its copies made, but without what it attaches."""

    def __len__(self) -> int:
        """How many names there are."""
        return len(self.parts) + len(self.cameras) + len(self.bodies)

    @property
    def letters(self) -> int:
        """The total length of the names."""
        return sum(len(name) for _, name in self.parts) + sum(
            map(len, (*self.cameras, *self.bodies))
        )

    def attach(self, other: Model, prefix: str) -> None:
        """Add another model, with a prefix before all its names."""
        self.joints |= {prefix + name: size for name, size in other.joints.items()}
        self.sensors |= {prefix + name: size for name, size in other.sensors.items()}
        self.actuators |= {prefix + name: size for name, size in other.actuators.items()}
        self.cameras |= {prefix + name: size for name, size in other.cameras.items()}
        self.bodies |= {prefix + name for name in other.bodies}
        for (section, name), part in other.parts.items():
            joint, actuator = (name and prefix + name for name in (part.joint, part.actuator))
            object_, reference = (_prefixed(e, prefix) for e in (part.object, part.reference))
            self.parts[section, prefix + name] = replace(
                part, joint=joint, actuator=actuator, object=object_, reference=reference
            )
        self.complete &= other.complete

    def joint_kind(self, name: str) -> str:
        """`hinge`, `slide`, `ball` or `free`; empty where that is not known."""
        part = self.parts.get(("joint", name))
        return part.kind if part else ""

    def joint_range(self, name: str) -> tuple[float, float] | None:
        """Limits of a hinge or a slide, rad or m; None where they are not known."""
        return self.parts.get(("joint", name), ModelPart("")).range

    def driven(self, name: str, *, direct: bool = False) -> str:
        """The joint that an actuator drives, if `direct` with a gear of 1; empty if none."""
        part = self.parts.get(("actuator", name), ModelPart(""))
        return "" if direct and part.geared else part.joint


def _prefixed(each: ModelObject | None, prefix: str) -> ModelObject | None:
    return each and (each[0], prefix + each[1])
