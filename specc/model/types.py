"""Types of values: shape, unit and coordinate frame. Two types are the same when they are equal.

A frame is a name; in an operator's signature a name that starts with "?" is a frame variable,
which stands for any frame (see `specc.lang.context`).

What follows from how a type is made, its class says here; all else that is known of it, its row in
`specc.lang.kinds`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self

from specc.model.units import DIMENSIONLESS, METRE, NEWTON, NEWTON_METRE, RADIAN, SECOND, Unit
from specc.reachable import reachable

Frame = str


class _TypeBase:
    """Defaults of the properties of types."""

    __slots__ = ()
    _PARTS: ClassVar[tuple[str, ...]] = ()
    """The fields with the types that a type is made of."""
    _FRAMES: ClassVar[tuple[str, ...]] = ()
    """The fields with frames."""

    @property
    def is_discrete(self) -> bool:
        """Whether two values are surely the same or not, so that `==` compares them."""
        return False

    @property
    def is_array(self) -> bool:
        """Whether values are arrays of reals, of which a partial one may lack some."""
        return False

    @property
    def units(self) -> tuple[Unit, ...]:
        """The units of a real or of the reals of which a vector consists, each once."""
        return ()

    @property
    def parts(self) -> tuple[Type, ...]:
        """The types that a type is made of."""
        return tuple(getattr(self, name) for name in self._PARTS)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the components, where they have names."""
        return ()

    @property
    def frames(self) -> tuple[Frame, ...]:
        """The frames that a type names, from left to right."""
        own = (getattr(self, name) for name in self._FRAMES)
        return (*filter(None, own), *(frame for part in self.parts for frame in part.frames))

    @property
    def extent(self) -> tuple[int, int]:
        """Parts of a type with the types in it written out, and how many levels they make."""
        return 1, 1

    @property
    def components(self) -> tuple[Type, ...]:
        """The types of the components of a vector."""
        return ()

    def framed(self, frame: Callable[[Frame], Frame]) -> Self:
        """The same type in other frames; a record or an opaque type loses one that becomes ""."""
        own = {name: old for name in self._FRAMES if (old := getattr(self, name))}
        changed = {name: frame(old) for name, old in own.items()}
        changed |= {name: getattr(self, name).framed(frame) for name in self._PARTS}
        return replace(self, **changed) if changed else self  # type: ignore[type-var]  # a dataclass


@dataclass(frozen=True, slots=True)
class Bool(_TypeBase):
    is_discrete = True

    def __str__(self) -> str:
        return "bool"


@dataclass(frozen=True, slots=True)
class Int(_TypeBase):
    is_discrete = True

    def __str__(self) -> str:
        return "int"


@dataclass(frozen=True, slots=True)
class Real(_TypeBase):
    unit: Unit = DIMENSIONLESS

    @property
    def units(self) -> tuple[Unit, ...]:
        return (self.unit,)

    def __str__(self) -> str:
        return "real" if self.unit == DIMENSIONLESS else f"real[{self.unit}]"


@dataclass(frozen=True, slots=True)
class Text(_TypeBase):
    is_discrete = True

    def __str__(self) -> str:
        return "text"


@dataclass(frozen=True, slots=True)
class File(_TypeBase):
    """A file of the specification, named under `files:`."""

    def __str__(self) -> str:
        return "file"


@dataclass(frozen=True, slots=True)
class Enum(_TypeBase):
    name: str
    members: tuple[str, ...]
    is_discrete = True

    def __str__(self) -> str:
        return self.name or f"enum[{', '.join(self.members)}]"


@dataclass(frozen=True, slots=True)
class Vector(_TypeBase):
    """`size` elements that are all reals of one unit, integers, booleans or of one enum.

    With a `frame` it is a point: three metres along its axes, from its origin.
    """

    size: int
    element: Real | Enum | Int | Bool
    frame: Frame = ""
    _PARTS = ("element",)
    _FRAMES = ("frame",)

    @property
    def is_discrete(self) -> bool:
        return self.element.is_discrete

    @property
    def is_array(self) -> bool:
        return isinstance(self.element, Real)

    @property
    def units(self) -> tuple[Unit, ...]:
        return self.element.units

    @property
    def names(self) -> tuple[str, ...]:
        return {3: VECTOR3_COMPONENTS, 6: SPATIAL_COMPONENTS}.get(self.size, ())

    @property
    def components(self) -> tuple[Type, ...]:
        return (self.element,) * self.size

    def __str__(self) -> str:
        if self.frame:
            return f"point[{self.frame.lstrip('?')}]"
        inner = self.element.unit if isinstance(self.element, Real) else self.element
        return f"vector[{self.size}]" if str(inner) == "1" else f"vector[{self.size}, {inner}]"


@dataclass(frozen=True, slots=True)
class Spatial(_TypeBase):
    """Six components: three along the axes of `frame`, then three about them."""

    frame: Frame
    linear: Unit
    angular: Unit
    is_array = True
    _FRAMES = ("frame",)

    @property
    def units(self) -> tuple[Unit, ...]:
        return self.linear, self.angular

    @property
    def names(self) -> tuple[str, ...]:
        return SPATIAL_COMPONENTS

    @property
    def components(self) -> tuple[Type, ...]:
        return (Real(self.linear),) * 3 + (Real(self.angular),) * 3

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


@dataclass(frozen=True, slots=True)
class Pose(_TypeBase):
    """Pose of `child` in `parent`, X_parent_child; the paper's left-superscript parent."""

    parent: Frame
    child: Frame
    is_array = True
    _FRAMES = ("parent", "child")

    def __str__(self) -> str:
        return f"pose[{self.parent.lstrip('?')}, {self.child.lstrip('?')}]"


@dataclass(frozen=True, slots=True)
class Image(_TypeBase):
    """`channels` is 3 for RGB (bytes) and 1 for a depth map (metres)."""

    height: int
    width: int
    channels: int

    def __str__(self) -> str:
        return f"image[{self.height}, {self.width}, {self.channels}]"


@dataclass(frozen=True, slots=True)
class ListOf(_TypeBase):
    """Items of one type; a list that is `nonempty` has at least one."""

    element: Type
    nonempty: bool = False
    _PARTS = ("element",)

    @property
    def extent(self) -> tuple[int, int]:
        return _nested_extent(self.element.extent)

    def __str__(self) -> str:
        return f"{'nonempty' if self.nonempty else 'list'}[{self.element}]"


@dataclass(frozen=True, slots=True)
class OptionalOf(_TypeBase):
    """A value of a type, or None."""

    value: Type
    _PARTS = ("value",)

    @property
    def extent(self) -> tuple[int, int]:
        return _nested_extent(self.value.extent)

    def __str__(self) -> str:
        return f"optional[{self.value}]"


@dataclass(frozen=True, slots=True)
class PartialOf(_TypeBase):
    """A vector of reals or a spatial vector; some of its components may be missing, spelt `_`."""

    value: Vector | Spatial
    is_array = True
    _PARTS = ("value",)

    def __str__(self) -> str:
        return f"partial[{self.value}]"


@dataclass(frozen=True, slots=True)
class Record(_TypeBase):
    """Named fields. `python` is the class of its values, `module:Class`, or "" to generate one."""

    name: str
    frames: tuple[Frame, ...] = field()  # else that of all types were its default
    fields: tuple[tuple[str, Type], ...]
    python: str = ""
    extent: tuple[int, int] = field(init=False, repr=False, compare=False)
    """Kept, since records of records may share what is in them."""
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Compute once the extent (parts, levels), and the hash, which leaves `python` out."""
        object.__setattr__(
            self, "extent", _nested_extent(*(type_.extent for _, type_ in self.fields))
        )
        object.__setattr__(self, "_hash", hash((self.name, self.frames, self.fields)))

    def __hash__(self) -> int:
        return self._hash

    @property
    def parts(self) -> tuple[Type, ...]:
        return tuple(type_ for _, type_ in self.fields)

    def field(self, name: str) -> Type | None:
        return dict(self.fields).get(name)

    def framed(self, frame: Callable[[Frame], Frame]) -> Record:
        fields = tuple((name, type_.framed(frame)) for name, type_ in self.fields)
        return Record(self.name, _mapped_frames(frame, self.frames), fields, self.python)

    def __str__(self) -> str:
        return _with_frames(self.name, self.frames)


@dataclass(frozen=True, slots=True)
class Opaque(_TypeBase):
    """A value that only operators look into; `python` is its class, `module:Class`.

    `codec` has the functions that make bytes of a value and a value of bytes, or is empty.
    """

    name: str
    frames: tuple[Frame, ...] = field()
    python: str
    codec: tuple[str, ...] = ()

    def framed(self, frame: Callable[[Frame], Frame]) -> Opaque:
        return replace(self, frames=_mapped_frames(frame, self.frames))

    def __str__(self) -> str:
        return _with_frames(self.name, self.frames)


def point(frame: Frame) -> Vector:
    """The type of points in a frame; "" for vectors that may stand for them."""
    return Vector(3, Real(METRE), frame)


def complete_type(type: Type) -> Type:
    """The type of a value whose components are all present."""
    return type.value if isinstance(type, PartialOf) else type


def _with_frames(name: str, frames: tuple[Frame, ...]) -> str:
    return f"{name}[{', '.join(f.lstrip('?') for f in frames)}]" if frames else name


Type = (
    Bool | Int | Real | Text | File | Enum | Vector | Spatial | Pose | Image | ListOf
    | OptionalOf | PartialOf | Record | Opaque
)  # fmt: skip


def nested_types(types: Iterable[Type]) -> dict[Type, None]:
    """Some types and all that they are made of, as an ordered set: those themselves first."""
    return reachable(types, lambda type_: type_.parts)


def _nested_extent(*inner: tuple[int, int]) -> tuple[int, int]:
    """The extent of a type around others."""
    return 1 + sum(parts for parts, _ in inner), 1 + max((n for _, n in inner), default=0)


def _mapped_frames(frame: Callable[[Frame], Frame], frames: tuple[Frame, ...]) -> tuple[Frame, ...]:
    return tuple(filter(None, map(frame, frames)))
