"""Without a function in between, an element has as many numbers as what stands behind it."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.bindings import Bound
from specc.mjcf import Model
from specc.model.system import System
from specc.model.types import Image, Real, Spatial, Type, Vector

_DEFAULT_CAMERA = (640, 480)
"""Width and height of images of a camera whose resolution the model does not say."""


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0507."""
    model = facts.model
    if not isinstance(model, Model):
        return
    for bound in facts.bindings:
        if bound.binding.through:
            continue
        sizes = _image_sizes(bound, model) or _number_sizes(bound, model)
        if sizes and sizes[0] != sizes[1]:
            yield Diagnostic(
                "E0507",
                f"`{bound.element.name}` has {sizes[0]}, the plant {sizes[1]}",
                bound.binding.place,
                related=(Related(bound.element.place, f"`{bound.element.type}`"),),
                help="make both the same, or name a function under `through:` that converts",
            )


def _number_sizes(bound: Bound, model: Model) -> tuple[str, str] | None:
    """Numbers of the element and of the plant, in words; None where one is not known."""
    wanted, binding = _size(bound.element.type), bound.binding
    parts = [model.actuators.get(name) for name in binding.actuators]
    if not bound.commanded:
        parts += [model.joints.get(name) for name in binding.joints]
        parts += [model.sensors.get(name) for name in binding.sensors]
    known = [size for size in parts if size is not None]
    if wanted is None or not parts or len(known) != len(parts):
        return None
    return _numbers(wanted), _numbers(sum(known))


def _image_sizes(bound: Bound, model: Model) -> tuple[str, str] | None:
    camera, type_ = bound.binding.camera, bound.element.type
    if camera not in model.cameras or not isinstance(type_, Image):
        return None
    width, height = model.cameras[camera] or _DEFAULT_CAMERA
    return f"{type_.width} x {type_.height} pixels", f"{width} x {height} pixels"


def _size(type_: Type) -> int | None:
    match type_:
        case Real():
            return 1
        case Vector(size=size, element=Real()):
            return size
        case Spatial():
            return 6
    return None


def _numbers(count: int) -> str:
    return "1 number" if count == 1 else f"{count} numbers"
