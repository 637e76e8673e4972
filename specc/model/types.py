"""Types of values: shape, unit and coordinate frame. Two types are the same when they are equal.

A frame is a name; in an operator's signature a name that starts with "?" is a frame variable,
which stands for any frame (see `specc.lang.unify`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from itertools import count
from zlib import crc32

from specc.frozen import frozen
from specc.model.units import DIMENSIONLESS, METRE, NEWTON, NEWTON_METRE, RADIAN, SECOND, Unit

Frame = str


def marks() -> Iterator[int]:
    """Those of parameters, in their order: large numbers whose sums and products all differ."""
    return (2**32 + crc32(str(number).encode()) for number in count())


class OpenSize(int):
    """A size that a parameter is to give: a small example of it, spelt as the parameter is.

    It equals no number, and another such size if both are computed alike: `mark` is the value that
    it has if each parameter is a large number that nobody writes.
    """

    name: str
    mark: int

    def __new__(cls, mark: int, name: str) -> OpenSize:
        made = super().__new__(cls, 11 + mark % 7)
        made.mark, made.name = mark, name
        return made

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OpenSize) and self.mark == other.mark

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = int.__hash__

    def __repr__(self) -> str:
        return f"{self.name}: {self.mark}"

    def __str__(self) -> str:
        return self.name


@frozen
class Bool:
    def __str__(self) -> str:
        return "bool"


@frozen
class Int:
    def __str__(self) -> str:
        return "int"


@frozen
class Real:
    unit: Unit = DIMENSIONLESS

    def __str__(self) -> str:
        return "real" if self.unit == DIMENSIONLESS else f"real[{self.unit}]"


@frozen
class Text:
    def __str__(self) -> str:
        return "text"


@frozen
class File:
    """A file of the specification, named under `files:`."""

    def __str__(self) -> str:
        return "file"


@frozen
class Enum:
    name: str
    members: tuple[str, ...]

    def __str__(self) -> str:
        return self.name or f"enum[{', '.join(self.members)}]"


@frozen
class Vector:
    """`size` elements that are all reals of one unit, integers, booleans or of one enum.

    With a `frame` it is a point: three metres along its axes, from its origin.
    """

    size: int
    element: Real | Enum | Int | Bool
    frame: Frame = ""

    def __str__(self) -> str:
        if self.frame:
            return f"point[{self.frame.lstrip('?')}]"
        inner = self.element.unit if isinstance(self.element, Real) else self.element
        return f"vector[{self.size}]" if str(inner) == "1" else f"vector[{self.size}, {inner}]"


@frozen
class Spatial:
    """Six components: three along the axes of `frame`, then three about them."""

    frame: Frame
    linear: Unit
    angular: Unit

    def __str__(self) -> str:
        short = _SPATIAL_NAMES.get((self.linear, self.angular))
        if short:
            return f"{short}[{self.frame.lstrip('?')}]"
        return f"spatial[{self.frame.lstrip('?')}, {self.linear}, {self.angular}]"


SPATIAL_COMPONENTS = ("x", "y", "z", "ax", "ay", "az")
VECTOR3_COMPONENTS = ("x", "y", "z")
SPATIAL_KINDS = {
    "wrench": (NEWTON, NEWTON_METRE),
    "twist": (METRE / SECOND, RADIAN / SECOND),
}
_SPATIAL_NAMES = {units: name for name, units in SPATIAL_KINDS.items()}


@frozen
class Pose:
    """Pose of `child` in `parent`, X_parent_child; the paper's left-superscript parent."""

    parent: Frame
    child: Frame

    def __str__(self) -> str:
        return f"pose[{self.parent.lstrip('?')}, {self.child.lstrip('?')}]"


@frozen
class Image:
    """`channels` is 3 for RGB (bytes) and 1 for a depth map (metres)."""

    height: int
    width: int
    channels: int

    def __str__(self) -> str:
        return f"image[{self.height}, {self.width}, {self.channels}]"


@frozen
class ListOf:
    """Items of one type; a list that is `nonempty` has at least one."""

    element: Type
    nonempty: bool = False

    def __str__(self) -> str:
        return f"{'nonempty' if self.nonempty else 'list'}[{self.element}]"


@frozen
class OptionalOf:
    """A value of a type, or None."""

    value: Type

    def __str__(self) -> str:
        return f"optional[{self.value}]"


@frozen
class PartialOf:
    """A vector of reals or a spatial vector; some of its components may be missing, spelt `_`."""

    value: Vector | Spatial

    def __str__(self) -> str:
        return f"partial[{self.value}]"


@frozen
class Record:
    """Named fields. `python` is the class of its values, `module:Class`, or "" to generate one."""

    name: str
    frames: tuple[Frame, ...]
    fields: tuple[tuple[str, Type], ...]
    python: str = ""
    extent: tuple[int, int] = field(init=False, repr=False, compare=False)
    """As `extent` of a type; kept, since records of records may share what is in them."""
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        inner = [extent(type_) for _, type_ in self.fields] or [(0, 0)]
        whole = 1 + sum(parts for parts, _ in inner), 1 + max(levels for _, levels in inner)
        object.__setattr__(self, "extent", whole)
        object.__setattr__(self, "_hash", hash((self.name, self.frames, self.fields)))

    def __hash__(self) -> int:
        return self._hash

    def field(self, name: str) -> Type | None:
        return dict(self.fields).get(name)

    def __str__(self) -> str:
        return _applied(self.name, self.frames)


@frozen
class Opaque:
    """A value that only operators look into; `python` is its class, `module:Class`.

    `codec` has the functions that make bytes of a value and a value of bytes, or is empty.
    """

    name: str
    frames: tuple[Frame, ...]
    python: str
    codec: tuple[str, ...] = ()

    def __str__(self) -> str:
        return _applied(self.name, self.frames)


def point(frame: Frame) -> Vector:
    """The type of points in a frame; "" for vectors that may stand for them."""
    return Vector(3, Real(METRE), frame)


def whole(type: Type) -> Type:
    """The type of a value of which nothing is missing."""
    return type.value if isinstance(type, PartialOf) else type


def _applied(name: str, frames: tuple[Frame, ...]) -> str:
    return f"{name}[{', '.join(f.lstrip('?') for f in frames)}]" if frames else name


Type = (
    Bool | Int | Real | Text | File | Enum | Vector | Spatial | Pose | Image | ListOf
    | OptionalOf | PartialOf | Record | Opaque
)  # fmt: skip


def inner_types(type_: Type) -> tuple[Type, ...]:
    """The types that a type is made of."""
    match type_:
        case ListOf(element=inner) | Vector(element=inner) | OptionalOf(value=inner):
            return (inner,)
        case Record(fields=fields):
            return tuple(inner for _, inner in fields)
    return ()


def extent(type_: Type) -> tuple[int, int]:
    """Parts of a type with the types in it written out, and how many levels they make."""
    match type_:
        case ListOf(element=inner) | OptionalOf(value=inner):
            parts, levels = extent(inner)
            return parts + 1, levels + 1
        case Record():
            return type_.extent
    return 1, 1
