"""Kinds and units of what a model of the plant has, beside what bindings ask of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from specc.frozen import frozen
from specc.mjcf import Model
from specc.model.system import Binding, Element, Plant, System
from specc.model.types import Image, Real, Spatial, Type, Vector
from specc.model.units import DIMENSIONLESS, METRE, NEWTON, NEWTON_METRE, RADIAN, SECOND, Unit

# What stands behind the elements of devices in the plant.


PlantKind = Literal["model", "python", ""]


@frozen
class Bound:
    """A binding of an element that exists; `commanded` tells x of a device from y.

    `plant` is of what kind the plant is; empty if it is of none or of both.
    """

    binding: Binding
    element: Element
    commanded: bool
    plant: PlantKind


def plant_kind(plant: Plant | None) -> PlantKind:
    """Whether a MuJoCo model or Python stands behind the devices."""
    if plant is None or bool(plant.model) == bool(plant.python):
        return ""
    return "model" if plant.model else "python"


def bound_elements(system: System) -> Iterator[Bound]:
    """The bindings whose device and element exist."""
    devices = {device.qualified_name: device for device in system.devices}
    kind = plant_kind(system.plant)
    for binding in system.plant.bindings if system.plant else ():
        device = devices.get(binding.device)
        if device is None:
            continue
        for elements, commanded in ((device.x, True), (device.y, False)):
            for element in elements:
                if element.name == binding.element:
                    yield Bound(binding, element, commanded, kind)


# What a binding has to name: what is commanded moves actuators, what is reported is measured.


_OF_A_MODEL = (
    "joints", "sensors", "actuators", "camera", "image", "noise", "depth_noise", "through",
)  # fmt: skip

_OF_SAMPLES = ("rate_hz", "sporadic", "max_gap_s")


def wrong_kind(bound: Bound) -> tuple[str, str] | None:
    """What is wrong with the kind of a binding, and a way out; None if nothing is."""
    if not bound.plant:
        return None
    if not bound.commanded and (complaint := _sampled(bound.binding)):
        return complaint
    if bound.plant == "python":
        return _in_python(bound)
    return _commanded(bound) if bound.commanded else _reported(bound)


def _sampled(binding: Binding) -> tuple[str, str] | None:
    """Of samples it is said when they come, or that this is not known."""
    if binding.sporadic and binding.rate_hz is not None:
        return (
            "a sporadic device has no rate: its readers look for a sample in each of their periods",
            "delete `rate`; `max_gap` says for how long there may be no new sample",
        )
    if binding.max_gap_s is not None and not binding.sporadic:
        return "`max_gap` is for sporadic devices", "add `sporadic: true`, or delete `max_gap`"
    return None


def _in_python(bound: Bound) -> tuple[str, str] | None:
    """A plant in Python gives and takes the elements themselves."""
    name = bound.element.name
    modelled = _named(bound.binding, _OF_A_MODEL)
    if modelled:
        return (
            f"`{modelled}` is for MuJoCo models; the plant in Python "
            f"{'takes' if bound.commanded else 'gives'} `{name}` itself",
            f"delete `{modelled}`",
        )
    return _command_measured(bound, _OF_SAMPLES)


def _commanded(bound: Bound) -> tuple[str, str] | None:
    binding, name = bound.binding, bound.element.name
    if not binding.actuators:
        return f"`{name}` is commanded, but moves no actuator", "add `actuators: [...]`"
    kinds = ("sensors", "camera", "image", "noise", "depth_noise")
    return _command_measured(bound, (*kinds, *_OF_SAMPLES)) or _type_without_through(bound)


def _command_measured(bound: Bound, kinds: tuple[str, ...]) -> tuple[str, str] | None:
    measured = _named(bound.binding, kinds) if bound.commanded else ""
    if not measured:
        return None
    return (
        f"`{bound.element.name}` is commanded: `{measured}` is for what a device reports",
        f"delete `{measured}`",
    )


def _reported(bound: Bound) -> tuple[str, str] | None:
    binding, name = bound.binding, bound.element.name
    numbers = _named(binding, ("joints", "sensors", "actuators"))
    if binding.camera:
        return _from_camera(bound, numbers)
    if not numbers:
        return (
            f"`{name}` is reported, but nothing measures it",
            "add `joints:`, `sensors:` or `camera:`",
        )
    if binding.image:
        return f"`image` of `{name}` needs a camera", "add `camera:`"
    return _type_without_through(bound)


def _from_camera(bound: Bound, numbers: str) -> tuple[str, str] | None:
    binding, type_ = bound.binding, bound.element.type
    if numbers:
        return f"a camera cannot be combined with `{numbers}`", f"delete `{numbers}` or `camera`"
    if not binding.image:
        return "a camera gives two images", "add `image: rgb` or `image: depth`"
    if binding.through:
        return None
    channels = 3 if binding.image == "rgb" else 1
    if not isinstance(type_, Image):
        return f"a camera gives an image, not {type_}", "add `through:` a function that makes one"
    if type_.channels != channels:
        fitting = f"image[{type_.height}, {type_.width}, {channels}]"
        given = "1 channel" if channels == 1 else f"{channels} channels"
        message = f"an image of kind {binding.image} has {given}, not {type_.channels}"
        return message, f'choose the other kind of image, or make the type "{fitting}"'
    return None


def _type_without_through(bound: Bound) -> tuple[str, str] | None:
    if bound.binding.through or _is_numbers(bound.element.type):
        return None
    message = f"the plant works with real numbers, not with {bound.element.type}"
    return message, "name a function under `through:` that converts"


def _is_numbers(type_: Type) -> bool:
    if isinstance(type_, Vector):
        return isinstance(type_.element, Real)
    return isinstance(type_, (Real, Spatial))


def _named(binding: Binding, names: tuple[str, ...]) -> str:
    """The first of these keys that the binding has, as the file spells it."""
    found = (name for name in names if getattr(binding, name))
    spelt = {"rate_hz": "rate", "depth_noise": "noise", "max_gap_s": "max_gap"}
    return spelt.get(name := next(found, ""), name)


# What the numbers behind an element are measured in, as far as the model of the plant says.


_UNITS: dict[str, Unit] = {
    tag: unit
    for tags, unit in (
        ("touch force tendonactuatorfrc tendonlimitfrc", NEWTON),
        ("torque", NEWTON_METRE),
        ("rangefinder distance fromto framepos subtreecom", METRE),
        ("tendonpos tendonlimitpos", METRE),
        ("velocimeter framelinvel subtreelinvel tendonvel tendonlimitvel", METRE / SECOND),
        ("gyro ballangvel frameangvel", RADIAN / SECOND),
        ("accelerometer framelinacc", METRE / SECOND**2),
        ("frameangacc", RADIAN / SECOND**2),
        ("framexaxis frameyaxis framezaxis framequat ballquat normal", DIMENSIONLESS),
        ("clock", SECOND),
    )
    for tag in tags.split()
}
"""Of sensors whose tag says it."""
_ABOUT_JOINTS = {
    "pos": "jointpos jointlimitpos actuatorpos position",
    "vel": "jointvel jointlimitvel actuatorvel velocity intvelocity",
    "frc": "jointactuatorfrc jointlimitfrc actuatorfrc motor",
}
"""Of sensors and actuators, where it depends on the joint."""
_OF_TAG = {tag: what for what, tags in _ABOUT_JOINTS.items() for tag in tags.split()}
_OF_JOINT = {
    "hinge": {"pos": RADIAN, "vel": RADIAN / SECOND, "frc": NEWTON_METRE},
    "slide": {"pos": METRE, "vel": METRE / SECOND, "frc": NEWTON},
}
_FORCES = (NEWTON, NEWTON_METRE)
_MECHANICAL = {*_UNITS.values(), *(unit for units in _OF_JOINT.values() for unit in units.values())}


class Raw(NamedTuple):
    """Numbers of one part of the model: their kind, the place in its list, name and units.

    `units` has one for each number, None where the model does not say; it is None as a whole where
    their number is not known.
    """

    kind: str
    place: int
    name: str
    units: tuple[Unit | None, ...] | None


def raw_numbers(bound: Bound, model: Model) -> Iterator[Raw]:
    """The numbers behind an element, or those that it sets, in their order."""
    binding = bound.binding
    if not bound.commanded:
        for index, name in enumerate(binding.joints):
            yield Raw("joints", index, name, _joint(name, model))
        for index, name in enumerate(binding.sensors):
            yield Raw("sensors", index, name, _sensor(name, model))
    for index, name in enumerate(binding.actuators):
        part = model.parts.get(("actuator", name))
        tag = part.kind if bound.commanded and part else "actuatorfrc"
        yield Raw("actuators", index, name, (_of_actuator(tag, name, model),))


def differs(raw: Raw, unit: Unit, wanted: Unit) -> bool:
    """Whether a unit of the plant is surely another than that of the element.

    What drives a motor is often a current, a voltage or a part of full drive.
    """
    if raw.kind == "actuators" and unit in _FORCES:
        return wanted != unit and wanted in _MECHANICAL - {DIMENSIONLESS}
    return wanted != unit


def units_of(type_: Type) -> tuple[Unit, ...] | None:
    """Units of the numbers that a value consists of; None if it does not consist of numbers."""
    match type_:
        case Real(unit=unit):
            return (unit,)
        case Vector(size=size, element=Real(unit=unit)):
            return (unit,) * size
        case Spatial(linear=linear, angular=angular):
            return (linear,) * 3 + (angular,) * 3
    return None


def _joint(name: str, model: Model) -> tuple[Unit | None, ...] | None:
    kind, size = model.joint_kind(name), model.joints.get(name)
    if kind == "free":
        return (METRE,) * 3 + (DIMENSIONLESS,) * 4
    unit = DIMENSIONLESS if kind == "ball" else _OF_JOINT.get(kind, {}).get("pos")
    return None if size is None else (unit,) * size


def _sensor(name: str, model: Model) -> tuple[Unit | None, ...] | None:
    size, part = model.sensors.get(name), model.parts.get(("sensor", name))
    if size is None or part is None:
        return None
    if part.actuator:
        return (_of_actuator(part.kind, part.actuator, model),)
    return (_UNITS.get(part.kind) or _at_joint(part.kind, part.joint, model),) * size


def _of_actuator(tag: str, name: str, model: Model) -> Unit | None:
    """What an actuator takes, or what is measured at it; a gear makes it anything."""
    return _at_joint(tag, model.driven(name, direct=True), model)


def _at_joint(tag: str, joint: str, model: Model) -> Unit | None:
    return _OF_JOINT.get(model.joint_kind(joint), {}).get(_OF_TAG.get(tag, ""))
