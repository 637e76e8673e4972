"""What stands behind elements of devices, and what is observed, in the plant; in which units."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from specc.lang import show
from specc.mjcf import Model, ModelError, read_model
from specc.model.bindings import PLANT, Binding, Widget
from specc.model.system import Element, Plant, System
from specc.model.types import Pose
from specc.model.units import DIMENSIONLESS, METRE, NEWTON, NEWTON_METRE, RADIAN, SECOND, Unit
from specc.reachable import grouped
from specc.read import AllowedPaths

# What stands behind the elements of devices in the plant.


PlantKind = Literal["model", "python", "ros2", ""]
POSE_UNITS = (METRE,) * 3 + (RADIAN,) * 3


@dataclass(frozen=True, slots=True)
class BoundElement:
    """A binding of an element that exists: a commanded one is an x of a device, another one a y.

    What requirements observe of the plant is bound like a y. `plant` is the kind of the plant that
    is behind it, empty if it has none or several; or it is the operator's panel.
    """

    binding: Binding
    element: Element
    is_commanded: bool
    plant: PlantKind | Literal["panel"]

    @property
    def is_pose(self) -> bool:
        """Whether numbers of a model are converted to a pose."""
        is_converted = self.plant == "model" and not (self.is_commanded or self.binding.through)
        return is_converted and isinstance(self.element.type, Pose)

    @property
    def units(self) -> tuple[Unit, ...] | None:
        """Units of the numbers of the element; None if it does not consist of numbers.

        A pose of a model consists of a position and of turns about three axes.
        """
        if self.is_pose:
            return POSE_UNITS
        type_ = self.element.type
        numbers = type_.components if type_.is_array else (type_,)
        return tuple(unit for part in numbers for unit in part.units) or None


def plant_kind(plant: Plant | None, *, is_of_ros: bool = False) -> PlantKind:
    """Whether a MuJoCo model, Python or ROS 2 stands behind the devices.

    A simulation with ROS 2 beside it has behind the node what `is_of_ros`, and nothing else.
    """
    if plant is not None and plant.ros2 is not None and is_of_ros:
        return "ros2"
    kinds: tuple[PlantKind, ...] = ("model", "python")
    found = [kind for kind in kinds if plant is not None and getattr(plant, kind)]
    if not found and plant is not None and plant.ros2 is not None:
        return "ros2"
    return found[0] if len(found) == 1 else ""


def bindable(system: System) -> Iterator[tuple[str, Element, bool]]:
    """The elements that a plant may bind: device, element, and whether it is commanded."""
    for device in system.devices:
        yield from ((device.qualified_name, element, True) for element in device.x)
        yield from ((device.qualified_name, element, False) for element in device.y)
    for element in system.plant.observed if system.plant else ():
        yield PLANT, element, False


def bound_elements(system: System) -> Iterator[BoundElement]:
    """The bindings whose device and element exist."""
    known = grouped(((name, e.name), (e, commanded)) for name, e, commanded in bindable(system))
    for binding in system.plant.bindings if system.plant else ():
        for element, commanded in known.get((binding.device, binding.element), ()):
            kind = plant_kind(system.plant, is_of_ros=binding.is_of_ros)
            yield BoundElement(binding, element, commanded, "panel" if binding.panel else kind)


_KEYS = {
    "rate_hz": "rate", "depth_noise": "noise", "max_gap_s": "max_gap", "message": "type",
    "answer_within_s": "answer_within",
}  # fmt: skip


def first_key(binding: Binding, attributes: Iterable[str]) -> str:
    """The first of some attributes that a binding has, as files spell its key; empty if none."""
    name = next((name for name in attributes if getattr(binding, name)), "")
    return _KEYS.get(name, name)


def widget_text(widget: Widget) -> str:
    """What of the panel sets an element, within which range and from which value on."""
    bounds = " to ".join(map(show, widget.bounds or ()))
    initial = "" if widget.initial is None else f"init {show(widget.initial)}"
    key = f"key {widget.key}" if widget.key else ""
    texts = widget.kind, "hold" if widget.hold else "", bounds, initial, key
    return ", ".join(text for text in texts if text)


def plant_model(system: System) -> Model | ModelError | None:
    """What the plant's model file declares, or why it cannot be read; None without one."""
    plant = system.plant
    if plant is None or not plant.model:
        return None
    base = os.path.dirname(plant.place.file)
    try:
        path = os.path.normpath(os.path.join(base, plant.model))  # a folder may be to come
        return read_model(path, AllowedPaths(system.folders))
    except ModelError as error:
        return error


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
"""Of sensors whose tag says it; how many numbers they give is in `specc.mjcf.model`."""
_TAGS_OF_JOINTS = {
    "pos": "jointpos jointlimitpos actuatorpos position",
    "vel": "jointvel jointlimitvel actuatorvel velocity intvelocity",
    "frc": "jointactuatorfrc jointlimitfrc actuatorfrc motor",
}
"""Of sensors and actuators, where it depends on the joint."""
_QUANTITY_OF_TAG = {tag: what for what, tags in _TAGS_OF_JOINTS.items() for tag in tags.split()}
_UNITS_OF_JOINT = {
    "hinge": {"pos": RADIAN, "vel": RADIAN / SECOND, "frc": NEWTON_METRE},
    "slide": {"pos": METRE, "vel": METRE / SECOND, "frc": NEWTON},
}
FREE = {"x": METRE, "y": METRE, "z": METRE, "yaw": RADIAN}
"""What a scene says of a free joint: where it is, and how it is turned about the vertical."""
_FORCES = (NEWTON, NEWTON_METRE)
_MECHANICAL = {
    *_UNITS.values(),
    *(unit for units in _UNITS_OF_JOINT.values() for unit in units.values()),
}


@dataclass(frozen=True, slots=True)
class RawNumbers:
    """Numbers of one part of the model: their kind, the place in its list, name and units.

    `units` has one for each number, None where the model does not say; it is None where their
    number is unknown.
    """

    kind: str
    index: int
    name: str
    units: tuple[Unit | None, ...] | None


def raw_numbers(bound: BoundElement, model: Model) -> Iterator[RawNumbers]:
    """The numbers of the model that an element is bound to, in their order.

    The quaternion of a pose counts as turns about three axes.
    """
    binding = bound.binding
    if bound.plant == "ros2":  # its joints are those of messages
        return
    if not bound.is_commanded:
        for index, name in enumerate(binding.joints):
            is_free = bound.is_pose and model.joint_kind(name) == "free"
            yield RawNumbers("joints", index, name, POSE_UNITS if is_free else _joint(name, model))
        for index, name in enumerate(binding.sensors):
            raw = RawNumbers("sensors", index, name, units_of_sensor(name, model))
            is_turned = bound.is_pose and is_orientation(raw, model)
            yield replace(raw, units=POSE_UNITS[3:]) if is_turned else raw
    for index, name in enumerate(binding.actuators):
        part = model.parts.get(("actuator", name))
        tag = part.kind if bound.is_commanded and part else "actuatorfrc"
        yield RawNumbers("actuators", index, name, (_of_actuator(tag, name, model),))


FRAME_POSITION, FRAME_ORIENTATION = "framepos", "framequat"
"""Sensors that give a pose together."""


def is_orientation(raw: RawNumbers, model: Model) -> bool:
    """Whether the numbers are the orientation of a frame, as a quaternion."""
    return _kind_of(raw, model) == FRAME_ORIENTATION


def is_quaternion(raw: RawNumbers, model: Model) -> bool:
    """Whether the numbers are a quaternion, in the order w, x, y, z of MuJoCo."""
    return _kind_of(raw, model) in ("ball", "ballquat", FRAME_ORIENTATION)


def _kind_of(raw: RawNumbers, model: Model) -> str:
    part = model.parts.get((raw.kind.removesuffix("s"), raw.name))
    return part.kind if part and raw.kind != "actuators" else ""


def is_another_unit(raw: RawNumbers, unit: Unit, wanted: Unit) -> bool:
    """Whether a unit of the plant is surely not that of the element.

    Motors are often driven by a current, a voltage or a duty cycle.
    """
    if raw.kind == "actuators" and unit in _FORCES:
        return wanted != unit and wanted in _MECHANICAL - {DIMENSIONLESS}
    return wanted != unit


def coordinate(name: str, model: Model) -> tuple[str, str]:
    """The joint that a scene names, and which coordinate of it, if it is followed by one."""
    joint, _, which = name.rpartition(".")
    return (joint, which) if name not in model.joints and which in FREE else (name, "")


def unit_of_coordinate(joint: str, which: str, model: Model) -> Unit | None:
    """The unit of a coordinate of a joint; None if it has no such coordinate."""
    kind = model.joint_kind(joint)
    return (
        FREE.get(which) if kind == "free" else _at_joint("position", "" if which else joint, model)
    )


def _joint(name: str, model: Model) -> tuple[Unit | None, ...] | None:
    kind, size = model.joint_kind(name), model.joints.get(name)
    if kind == "free":
        return (METRE,) * 3 + (DIMENSIONLESS,) * 4
    unit = DIMENSIONLESS if kind == "ball" else _UNITS_OF_JOINT.get(kind, {}).get("pos")
    return None if size is None else (unit,) * size


def units_of_sensor(name: str, model: Model) -> tuple[Unit | None, ...] | None:
    """Units of the numbers that a sensor gives; see `RawNumbers`."""
    size, part = model.sensors.get(name), model.parts.get(("sensor", name))
    if size is None or part is None:
        return None
    if part.actuator:
        return (_of_actuator(part.kind, part.actuator, model),)
    return (_UNITS.get(part.kind) or _at_joint(part.kind, part.joint, model),) * size


def _of_actuator(tag: str, name: str, model: Model) -> Unit | None:
    """The unit of an actuator's control, or of its sensor; unknown behind a gear."""
    return _at_joint(tag, model.driven(name, direct=True), model)


def _at_joint(tag: str, joint: str, model: Model) -> Unit | None:
    return _UNITS_OF_JOINT.get(model.joint_kind(joint), {}).get(_QUANTITY_OF_TAG.get(tag, ""))


Limit = tuple[str, tuple[float, float]]
"""What limits the control of an actuator, in words, and from where to where."""


def limits_of_control(name: str, model: Model) -> Iterator[Limit]:
    """The limits of an actuator's control, or of the joint that its servo moves."""
    part = model.parts.get(("actuator", name))
    if part is None:
        return
    if part.control_range:
        yield "`ctrlrange`", part.control_range
    if part.kind == "motor" and part.force_range:
        yield "`forcerange`", part.force_range
    joint = model.driven(name, direct=True)
    if part.kind == "position" and (reach := model.joint_range(joint)):
        yield f"range of joint `{joint}`", reach
