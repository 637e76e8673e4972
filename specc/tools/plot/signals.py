"""Signals of a recording: what a name on the command line stands for, and its numbers.

They are named as requirements name them: `irp.m` is the state of a subsystem, `irp.m.q_p` its
memory, `irp.m.x.c.T_d` an element of a buffer, `plant.gap` what is really so. Behind that may
stand a field of a record and the number of an item: `irp.m.q_p[2]`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from specc.diagnostics import nearest
from specc.diagnostics.phrases import join_some
from specc.lang.kinds import kind
from specc.lang.values import Floats, position
from specc.model.bindings import PLANT
from specc.model.system import Subsystem, System
from specc.model.types import (
    SPATIAL_COMPONENTS,
    VECTOR3_COMPONENTS,
    OptionalOf,
    Pose,
    Record,
    Spatial,
    Type,
    complete_type,
)
from specc.model.units import DIMENSIONLESS, METRE, RADIAN, Unit
from specc.refusal import Refused
from specc.tools.why import value_of

MOST_COMPONENTS = 12
"""Of a signal; more lines are not told apart."""
_STEP = re.compile(r"\.(?P<field>[^\W\d]\w*)|\[(?P<item>\d{1,6})\]")
_ROTATION = 1e-9
"""Sine below which an angle is that of no rotation, or of half a turn."""

_HALF = 0.75 * math.pi
_LARGEST = 1e100
"""Of what is drawn: axes cannot be as long as numbers can be large."""


class NoSignal(Refused):
    """A name stands for nothing that can be drawn; the message says why."""


@dataclass(frozen=True, slots=True)
class PlottedLine:
    """One line: its name in the legend, its unit, and the names of values that are no numbers."""

    name: str
    unit: str = ""
    words: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Signal:
    """An element of a subsystem, or of the plant, over time."""

    name: str
    title: str
    owner: str
    path: tuple[str, ...]
    """Where its data is in the messages of its owner."""
    components: tuple[PlottedLine, ...]
    numbers: Callable[[Any], Floats]
    """What its data says, NaN where there is nothing. Raises NotKnown for data of another type."""
    is_pose: bool = False
    """Whether its last three numbers are a rotation vector."""
    place: int = 0
    """Its number among the signals of its owner that are asked for."""


@dataclass(frozen=True, slots=True)
class _Element:
    """Something that recordings have: whose it is, where in the messages, its title and type."""

    owner: str
    path: tuple[str, ...]
    title: str
    type: Type


def resolve_signal(system: System, name: str) -> Subsystem | Signal:
    """What a name stands for: a subsystem is the state of its machine. Raises NoSignal."""
    for subsystem in system.subsystems:
        if name == subsystem.qualified_name:
            return subsystem
    known = dict(_elements(system))
    begins = [at for at in known if name.startswith(at) and name[len(at) :][:1] in ("", ".", "[")]
    if not begins:
        raise NoSignal(_unknown(system, name, list(known)))
    at = max(begins, key=len)
    steps = _steps(at, name[len(at) :])
    return _signal(name, known[at], _part_type(at, known[at].type, steps), steps)


def _signal(name: str, element: _Element, type_: Type, steps: Sequence[str | int]) -> Signal:
    """The part of an element that has this type. Raises NoSignal."""
    components = _lines_of_type(name, type_)

    def numbers(data: Any) -> Floats:
        value = _part(value_of(element.type, data), steps)
        return (math.nan,) * len(components) if value is None else _numbers(type_, value)

    is_pose = isinstance(_present(type_), Pose)
    return Signal(name, element.title, element.owner, element.path, components, numbers, is_pose)


@dataclass(frozen=True, slots=True)
class ListedSignal:
    """Something that recordings have, by its name; `signal` is None if it cannot be drawn."""

    name: str
    title: str
    owner: str
    path: tuple[str, ...]
    type: Type
    signal: Signal | None


def list_signals(system: System) -> Iterator[ListedSignal]:
    """All elements of buffers and of memory, and what is observed of the plant."""
    for name, element in _elements(system):
        signal = None
        with suppress(NoSignal):
            signal = _signal(name, element, element.type, ())
        yield ListedSignal(name, element.title, element.owner, element.path, element.type, signal)


def _present(type_: Type) -> Type:
    """The type of a value of which nothing is missing."""
    return complete_type(type_.value if isinstance(type_, OptionalOf) else type_)


def _elements(system: System) -> Iterator[tuple[str, _Element]]:
    """All that recordings have, by name."""
    for subsystem in system.subsystems:
        owner = subsystem.qualified_name
        for direction, elements in (("x", subsystem.inputs), ("y", subsystem.outputs)):
            for (peer, name), item in elements.items():
                own = _Element(owner, (direction, peer, name), item.title, item.type)
                yield f"{owner}.{direction}.{peer}.{name}", own
        for memory in subsystem.memory:
            own = _Element(owner, ("memory", memory.name), memory.title, memory.type)
            yield f"{owner}.{memory.name}", own
    for item in system.plant.observed if system.plant else ():
        yield f"{PLANT}.{item.name}", _Element(PLANT, ("y", item.name), item.title, item.type)


def _unknown(system: System, name: str, known: Sequence[str]) -> str:
    """Why a name is none of a signal, with those that may be meant."""
    owners = [subsystem.qualified_name for subsystem in system.subsystems]
    owner = next((s for s in system.subsystems if name.startswith(f"{s.qualified_name}.")), None)
    if owner is None:
        close = nearest(name, [*known, *owners]) or nearest(".".join(name.split(".")[:2]), owners)
        hint = f"did you mean {' or '.join(close)}?" if close else _listed("there are", owners)
        devices = (device.qualified_name for device in system.devices)
        device = next((d for d in devices if f"{name}.".startswith(f"{d}.")), None)
        if device is not None:
            return f"{device} is a device; recordings have the buffers of its subsystem; {hint}"
        return f"there is no signal {name}; {hint}"
    rest = name.removeprefix(f"{owner.qualified_name}.")
    if rest in {let.name for let in owner.lets}:
        return f"{name} is a let, and recordings have none; they have what it is computed from"
    own = [each for each in known if each.startswith(f"{owner.qualified_name}.")]
    close = nearest(name, own)
    hint = f"did you mean {' or '.join(close)}?" if close else _listed("it has", own)
    return f"{owner.qualified_name} has no {rest}; {hint}"


def _listed(words: str, names: Sequence[str], most: int = 30) -> str:
    return f"{words} {join_some(names, most) or 'none'}"


def _steps(at: str, rest: str) -> tuple[str | int, ...]:
    """Fields and numbers of items behind the name of an element."""
    steps: list[str | int] = []
    place = 0
    while place < len(rest):
        step = _STEP.match(rest, place)
        if step is None:
            raise NoSignal(f"{at}{rest} is no signal: {rest[place:]} is neither .field nor [item]")
        steps.append(step["field"] or int(step["item"]))
        place = step.end()
    return tuple(steps)


def _part_type(at: str, type_: Type, steps: Sequence[str | int]) -> Type:
    """The type of a part. Raises NoSignal where there is none."""
    for step in steps:
        inner = _present(type_)
        keys = inner.names if isinstance(inner, Spatial) else range(len(inner.components))
        parts = dict(zip(keys, inner.components, strict=True))
        parts = dict(inner.fields) if isinstance(inner, Record) else parts
        if step not in parts:
            names = [f".{p}" if isinstance(p, str) else f"[{p}]" for p in parts]
            wrong = f".{step}" if isinstance(step, str) else f"[{step}]"
            raise NoSignal(f"{at} of type {type_} has no {wrong}; {_listed('it has', names)}")
        type_ = parts[step]
    return type_


def _part(value: Any, steps: Sequence[str | int]) -> Any:
    for step in steps:
        if value is None:
            return None
        if step in SPATIAL_COMPONENTS and isinstance(value, tuple):
            value = value[SPATIAL_COMPONENTS.index(str(step))]
        else:
            value = getattr(value, step) if isinstance(step, str) else value[step]
    return value


def _lines_of_type(name: str, type_: Type) -> tuple[PlottedLine, ...]:
    """The lines of a type. Raises NoSignal where it has none, or too many."""
    type_ = _present(type_)
    parts, row = type_.components, kind(type_)
    if len(parts) > MOST_COMPONENTS:
        raise NoSignal(f"{name} has {len(parts)} elements, too many to tell apart; name {name}[0]")
    if parts:
        names = type_.names if type_.frames else tuple(f"[{i}]" for i in range(len(parts)))
        found = (_lines_of_type(name, part)[0] for part in parts)
        return tuple(PlottedLine(n, c.unit, c.words) for n, c in zip(names, found, strict=True))
    if isinstance(type_, Pose):
        turned = [PlottedLine(f"r{n}", _unit(RADIAN)) for n in VECTOR3_COMPONENTS]
        return (*(PlottedLine(n, _unit(METRE)) for n in VECTOR3_COMPONENTS), *turned)
    if row.sort in ("whole", "real") or row.words(type_):
        return (PlottedLine("", "".join(map(_unit, type_.units)), row.words(type_)),)
    if isinstance(type_, Record):
        fields = ", ".join(f"{name}.{field}" for field, _ in type_.fields)
        raise NoSignal(f"{name} is a record; name one of its fields: {fields}")
    raise NoSignal(f"{name} of type {type_} is nothing that can be drawn as a line")


def _unit(unit: Unit) -> str:
    return "" if unit == DIMENSIONLESS else str(unit)


def _numbers(type_: Type, value: Any) -> Floats:
    """The numbers of the components of a type."""
    type_ = _present(type_)
    if isinstance(type_, Pose):
        return (*position(value), *rotation_vector(value))
    if parts := type_.components:
        return tuple([_numbers(part, item)[0] for part, item in zip(parts, value, strict=True)])
    if words := kind(type_).words(type_):
        return (float(words.index(str(value))),)
    return (float(value) if abs(value) < _LARGEST else math.nan,)


def rotation_vector(rows: Any) -> Floats:
    """The axis of a rotation times its angle of at most half a turn, rad."""
    r = rows
    axis = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1])
    sine, cosine = math.hypot(*axis) / 2, (r[0][0] + r[1][1] + r[2][2] - 1) / 2
    angle = math.atan2(sine, cosine)
    if sine > _ROTATION:
        return tuple(a / (2 * sine) * angle for a in axis)
    if cosine > 0:
        return 0.0, 0.0, 0.0
    # Half a turn: R + 1 is twice the square of the axis.
    k = max(range(3), key=lambda i: float(r[i][i]))
    column = [r[i][k] + (i == k) for i in range(3)]
    length = math.hypot(*column)
    return tuple(angle * c / length for c in column) if length else (math.nan,) * 3


def unwrap_rotations(vectors: Sequence[Floats]) -> list[Floats]:
    """Rotation vectors of the same rotations, each as near to the one before as it can be.

    Those of more than half a turn stand for what goes on turning. The first one, if it is about
    half a turn, has its largest component positive: two that are alike begin alike.
    """
    last: Floats | None = None
    found = []
    for vector in vectors:
        angle = math.hypot(*vector)
        if last is None and angle > _HALF:
            last = tuple(abs(a) if abs(a) == max(map(abs, vector)) else 0.0 for a in vector)
        if last is not None and angle > _ROTATION:
            along = sum(a * b for a, b in zip(last, vector, strict=True)) / angle
            turns = round((along - angle) / math.tau)
            vector = tuple(a * (1 + turns * math.tau / angle) for a in vector)
        if not math.isnan(angle):
            last = vector
        found.append(vector)
    return found
