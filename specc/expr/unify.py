"""Frame variables in the types of an operator's signature: binding them and filling them in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

from specc.model.types import (
    Frame,
    ListOf,
    Opaque,
    OptionalOf,
    PartialOf,
    Pose,
    Record,
    Spatial,
    Type,
)

Bindings = dict[Frame, Frame]
"""Frame variable, with its question mark -> actual frame."""


def unify(pattern: Type, actual: Type, bindings: Bindings) -> bool:
    """Whether `actual` is `pattern` for some frames; binds them. On False, nothing is bound."""
    if pattern == actual and not has_variables(pattern):
        return True
    if isinstance(pattern, (OptionalOf, PartialOf)):
        there = actual.value if type(actual) is type(pattern) else actual
        return unify(pattern.value, there, bindings)
    trial = dict(bindings)
    if not _same_shape(pattern, actual):
        return False
    pairs = zip(frames_of(pattern), frames_of(actual), strict=True)
    for wanted, frame in pairs:
        if wanted.startswith("?"):
            wanted = trial.setdefault(wanted, frame)
        if wanted != frame:
            return False
    bindings |= trial
    return True


def substitute(type: Type, bindings: Mapping[Frame, Frame]) -> Type:
    """The type with frames replaced wherever `bindings` has them."""

    def frame(name: Frame) -> Frame:
        return bindings.get(name, name)

    match type:
        case Pose():
            return Pose(frame(type.parent), frame(type.child))
        case Spatial():
            return replace(type, frame=frame(type.frame))
        case ListOf():
            return replace(type, element=substitute(type.element, bindings))
        case OptionalOf():
            return OptionalOf(substitute(type.value, bindings))
        case PartialOf(value=Spatial() as value):
            return PartialOf(replace(value, frame=frame(value.frame)))
        case Opaque():
            return replace(type, frames=tuple(map(frame, type.frames)))
        case Record():
            fields = tuple((name, substitute(inner, bindings)) for name, inner in type.fields)
            return replace(type, frames=tuple(map(frame, type.frames)), fields=fields)
    return type


def frames_of(type: Type) -> Iterator[Frame]:
    """The frames that a type names, from left to right."""
    match type:
        case Pose():
            yield type.parent
            yield type.child
        case Spatial():
            yield type.frame
        case ListOf(element=inner) | OptionalOf(value=inner) | PartialOf(value=inner):
            yield from frames_of(inner)
        case Opaque() | Record():
            yield from type.frames


def has_variables(type: Type) -> bool:
    """Whether a type still names a frame variable."""
    return any(frame.startswith("?") for frame in frames_of(type))


def _same_shape(pattern: Type, actual: Type) -> bool:
    """Whether two types differ in their frames at most."""
    match pattern, actual:
        case Pose(), Pose():
            return True
        case Spatial(), Spatial():
            return (pattern.linear, pattern.angular) == (actual.linear, actual.angular)
        case ListOf(), ListOf():
            enough = actual.nonempty or not pattern.nonempty
            return enough and _same_shape(pattern.element, actual.element)
        case OptionalOf(), OptionalOf():
            return _same_shape(pattern.value, actual.value)
        case PartialOf(), PartialOf():
            return _same_shape(pattern.value, actual.value)
        case (Opaque() | Record(), Opaque() | Record()):
            same = type(pattern) is type(actual) and pattern.name == actual.name
            return same and len(pattern.frames) == len(actual.frames)
    return pattern == actual
