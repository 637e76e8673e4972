"""What each binding names fits its element and the model: kinds, names, units, order, noise."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

from specc.analysis import Facts
from specc.analysis.plant import BoundElement, RawNumbers, first_key, is_another_unit, raw_numbers
from specc.diagnostics import Diagnostic, Related, nearest, rename_fix, sole_correction
from specc.diagnostics.phrases import counted, join_words
from specc.mjcf import Model, ModelError
from specc.mjcf.model import ModelPart
from specc.model.binding import PLANT, Binding
from specc.model.types import Image
from specc.model.units import Unit
from specc.source import Place

# A commanded element moves actuators; a reported one comes from joints, sensors or a camera.


def bindings_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0505."""
    for bound in facts.bindings:
        complaint = _wrong_kind(bound)
        if complaint:
            message, help_text = complaint
            related = (Related(bound.element.place, f"`{bound.element.type}`"),)
            yield Diagnostic("E0505", message, bound.binding.place, "", related, help_text)


_OF_A_MODEL = (
    "joints", "sensors", "actuators", "camera", "image", "noise", "depth_noise", "through",
)  # fmt: skip

_OF_TOPICS = ("topic", "message", "qos", "tf", "action", "part")

_OF_SAMPLES = ("rate_hz", "sporadic", "max_gap_s")


def _wrong_kind(bound: BoundElement) -> tuple[str, str] | None:
    """What is wrong with the kind of a binding, and a way out; None if nothing is."""
    if bound.plant in ("", "ros2"):  # topics have checks of their own
        return None
    if not bound.is_commanded and (complaint := _sampled(bound.binding)):
        return complaint
    if topic := first_key(bound.binding, _OF_TOPICS):
        return f"`{topic}` is for plants behind ROS 2", f"delete `{topic}`"
    if bound.plant == "python":
        return _in_python(bound)
    return _moving(bound) if bound.is_commanded else _reporting(bound)


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


def _in_python(bound: BoundElement) -> tuple[str, str] | None:
    """A plant in Python gives and takes the elements themselves."""
    name = bound.element.name
    modelled = first_key(bound.binding, _OF_A_MODEL)
    if modelled:
        return (
            f"`{modelled}` is for MuJoCo models; the plant in Python "
            f"{'takes' if bound.is_commanded else 'gives'} `{name}` itself",
            f"delete `{modelled}`",
        )
    return _command_measured(bound, _OF_SAMPLES)


def _moving(bound: BoundElement) -> tuple[str, str] | None:
    binding, name = bound.binding, bound.element.name
    if not binding.actuators:
        return f"`{name}` is commanded, but moves no actuator", "add `actuators: [...]`"
    kinds = ("sensors", "camera", "image", "noise", "depth_noise")
    return _command_measured(bound, (*kinds, *_OF_SAMPLES)) or _type_without_through(bound)


def _command_measured(bound: BoundElement, kinds: tuple[str, ...]) -> tuple[str, str] | None:
    measured = first_key(bound.binding, kinds) if bound.is_commanded else ""
    if not measured:
        return None
    return (
        f"`{bound.element.name}` is commanded: `{measured}` is for what a device reports",
        f"delete `{measured}`",
    )


def _reporting(bound: BoundElement) -> tuple[str, str] | None:
    binding, name = bound.binding, bound.element.name
    numbers = first_key(binding, ("joints", "sensors", "actuators"))
    if binding.camera:
        return _from_camera(bound, numbers)
    if not numbers:
        return (
            f"`{name}` is reported, but nothing measures it",
            "add `joints:` or `sensors:`" + (", or `camera:`" if binding.device != PLANT else ""),
        )
    if binding.image:
        return f"`image` of `{name}` needs a camera", "add `camera:`"
    return _type_without_through(bound)


def _from_camera(bound: BoundElement, numbers: str) -> tuple[str, str] | None:
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
        given = counted(channels, "channel")
        message = f"an image of kind {binding.image} has {given}, not {type_.channels}"
        return message, f'choose the other kind of image, or make the type "{fitting}"'
    return None


def _type_without_through(bound: BoundElement) -> tuple[str, str] | None:
    if bound.binding.through or bound.is_pose or bound.element.type.units:
        return None
    message = f"the plant works with real numbers, not with {bound.element.type}"
    return message, "name a function under `through:` that converts"


# The joints, sensors, actuators and cameras that bindings name are in the model.


def model_names_known(facts: Facts) -> Iterator[Diagnostic]:
    """E0502; names in a binding of the wrong kind are `bindings_fit`'s matter."""
    model = facts.model
    plant = facts.system.plant
    if plant is None or not isinstance(model, Model) or not model.complete:
        return
    unfit = [bound.binding for bound in facts.bindings if _wrong_kind(bound)]
    for binding in plant.bindings:
        for kind, names, known in _names_of(binding, model):
            for index, name in enumerate(names):
                if name not in known and binding not in unfit:
                    yield _unknown_name(_place_of(binding, kind, index), kind, name, known)


def _names_of(
    binding: Binding, model: Model
) -> Iterator[tuple[str, tuple[str, ...], Mapping[str, object]]]:
    yield "joint", binding.joints, model.joints
    yield "sensor", binding.sensors, model.sensors
    yield "actuator", binding.actuators, model.actuators
    yield "camera", (binding.camera,) if binding.camera else (), model.cameras


def _place_of(binding: Binding, kind: str, index: int) -> Place:
    if kind == "camera":
        return binding.place.below(kind)
    return binding.place.below(f"{kind}s", index)


def _unknown_name(place: Place, kind: str, name: str, known: Mapping[str, object]) -> Diagnostic:
    close = nearest(name, known)
    if close:
        hint = "did you mean " + " or ".join(f"`{n}`" for n in close) + "?"
    else:
        hint = "it has " + (", ".join(f"`{n}`" for n in list(known)[:8]) or f"no {kind}s")
    meant = sole_correction(name, close)
    fix = rename_fix(place, name, meant)
    return Diagnostic("E0502", f"the model has no {kind} `{name}`", place, help=hint, fix=fix)


# A binding names what measures or takes the element's quantity, each once.


_LISTS = ("joints", "sensors", "actuators")


def bindings_agree(facts: Facts) -> Iterator[Diagnostic]:
    """E0511, E0512; a binding of the wrong kind is `bindings_fit`'s matter."""
    model = facts.model
    for bound in facts.bindings:
        if _wrong_kind(bound):
            continue
        yield from _named_twice(bound)
        if isinstance(model, Model):
            yield from _units_differ(bound, model)


def _named_twice(bound: BoundElement) -> Iterator[Diagnostic]:
    """An actuator that is commanded twice is `actuators_driven_once`'s matter."""
    for kind in _LISTS[:2] if bound.is_commanded else _LISTS:
        names = getattr(bound.binding, kind)
        for index, name in enumerate(names):
            if name in names[:index]:
                first = bound.binding.place.below(kind, names.index(name))
                yield Diagnostic(
                    "E0512",
                    f"{kind.removesuffix('s')} `{name}` is listed twice",
                    bound.binding.place.below(kind, index),
                    related=(Related(first, "listed here already"),),
                    help="name another one, or delete it",
                )


def _units_differ(bound: BoundElement, model: Model) -> Iterator[Diagnostic]:
    wanted = bound.units
    if bound.binding.through or bound.is_pose or wanted is None:
        return
    start = 0
    for raw in raw_numbers(bound, model):
        if raw.units is None:
            return
        for unit, other in zip(wanted[start:], raw.units, strict=False):
            if other is not None and is_another_unit(raw, other, unit):
                yield _another_unit(bound, raw, unit, other)
                break
        start += len(raw.units)


def _another_unit(bound: BoundElement, raw: RawNumbers, unit: Unit, other: Unit) -> Diagnostic:
    verb = "takes" if bound.is_commanded else "gives"
    kind = raw.kind.removesuffix("s")
    return Diagnostic(
        "E0511",
        f"`{bound.element.name}` is in {unit}, and {kind} `{raw.name}` {verb} {other}",
        bound.binding.place.below(raw.kind, raw.place),
        related=(Related(bound.element.place, f"`{bound.element.type}`"),),
        help="name another one, or a function under `through:` that converts",
    )


# A distance that is measured is a number also where there is nothing to measure.


def distances_bounded(facts: Facts) -> Iterator[Diagnostic]:
    """W0515, of a range finder without a cutoff; a function of `through` may take what it gives."""
    for bound in facts.bindings:
        binding = bound.binding
        if not isinstance(facts.model, Model) or binding.through or _wrong_kind(bound):
            continue
        for index, name in enumerate(binding.sensors):
            part = facts.model.parts.get(("sensor", name))
            if part and part.kind == "rangefinder" and not part.cutoff:
                yield Diagnostic(
                    "W0515",
                    f"range finder `{name}` has no distance to give where its beam meets nothing",
                    binding.place.below("sensors", index),
                    help=f'give `{name}` a cutoff in the model, e.g. `cutoff="5"`: the distance, '
                    "in m, that it gives then",
                )


# Noise has one standard deviation per sensor, in its unit; that of the Kinect is for depth images.
#
# Noise is added to what a sensor gives, before any function of `through`.


DEPTH_NOISES = ("kinect",)


def noise_fits(facts: Facts) -> Iterator[Diagnostic]:
    """E0510; a binding of the wrong kind is `bindings_fit`'s matter."""
    for bound in facts.bindings:
        binding = bound.binding
        if bound.is_commanded or _wrong_kind(bound):
            continue
        complaint = _depth(binding) or _deviations(binding)
        if complaint:
            message, help_text = complaint
            yield Diagnostic("E0510", message, binding.place.below("noise"), help=help_text)
        else:
            yield from _units(bound, facts.model)


def _depth(binding: Binding) -> tuple[str, str] | None:
    if not binding.depth_noise:
        return None
    if binding.depth_noise not in DEPTH_NOISES:
        return f"there is no noise called `{binding.depth_noise}`", "write `noise: kinect`"
    if binding.image != "depth":
        return f"noise `{binding.depth_noise}` is for depth images", "delete it"
    return None


def _deviations(binding: Binding) -> tuple[str, str] | None:
    given, sensors = len(binding.noise), len(binding.sensors)
    if not given or given == sensors:
        return None
    message = f"{counted(given, 'standard deviation')} for {counted(sensors, 'sensor')}"
    return message, "give one for each of `sensors:`; joints and actuators have no noise"


def _units(bound: BoundElement, model: Model | ModelError | None) -> Iterator[Diagnostic]:
    binding = bound.binding
    several = len(binding.noise) > 1
    for index, unit in enumerate(binding.noise_units):
        measured = _measured(bound, model, index)
        if measured and unit not in measured:
            said = join_words(dict.fromkeys(map(str, measured)), "and")
            yield Diagnostic(
                "E0510",
                (
                    f"noise of sensor `{binding.sensors[index]}` is in {unit}, but "
                    f"the sensor gives {said}"
                ),
                binding.place.below("noise", *((index,) if several else ())),
                related=() if binding.through else (_type(bound),),
                help="write the standard deviation in the unit of what is measured",
            )


def _type(bound: BoundElement) -> Related:
    return Related(bound.element.place, f"`{bound.element.type}`")


def _measured(bound: BoundElement, model: Model | ModelError | None, sensor: int) -> list[Unit]:
    """Units of what a sensor gives, and of what the element has there; none if not known.

    Where the two differ, that is `bindings_agree`'s matter.
    """
    wanted = () if bound.binding.through else bound.units or ()
    start: int | None = 0
    for raw in raw_numbers(bound, model) if isinstance(model, Model) else ():
        if raw.kind == "sensors" and raw.place == sensor:
            units = raw.units or ()
            there = () if start is None else wanted[start : start + len(units)]
            return [unit for unit in (*units, *(there or _only(wanted))) if unit is not None]
        start = None if start is None or raw.units is None else start + len(raw.units)
    return _only(wanted)


def _only(units: Sequence[Unit]) -> list[Unit]:
    """The unit of numbers that all have one."""
    return list(units[:1]) if len(set(units)) == 1 else []


# Within a binding: `through` gets joints and sets actuators.


def joints_like_actuators(facts: Facts) -> Iterator[Diagnostic]:
    """W0513."""
    for bound in facts.bindings:
        if bound.is_commanded and bound.plant == "model" and isinstance(facts.model, Model):
            yield from _disordered(bound, facts.model)


def _disordered(bound: BoundElement, model: Model) -> Iterator[Diagnostic]:
    """W0513, of the joints that are listed and driven too."""
    listed = bound.binding.joints
    driven = [model.driven(name) for name in bound.binding.actuators]
    both = [name for name in driven if name in listed]
    wanted, found = iter(both), [name for name in listed if name in driven]
    if len(set(both)) < len(both) or len(set(found)) < len(found):
        return
    for name in found:
        if name != (other := next(wanted)):
            place = bound.binding.place
            actuator = bound.binding.actuators[driven.index(other)]
            yield Diagnostic(
                "W0513",
                f"joint `{name}` is listed where actuator `{actuator}` drives `{other}`",
                place.below("joints", listed.index(name)),
                related=(
                    Related(place.below("actuators", driven.index(other)), f"drives `{other}`"),
                ),
                help=f"list both in the same order: `joints: [{', '.join(both)}]`",
            )
            return


# Between bindings: elements of one subsystem are vectors over the same joints.


def elements_in_one_order(facts: Facts) -> Iterator[Diagnostic]:
    """W0513, of the elements of all devices that one subsystem works with."""
    if not isinstance(facts.model, Model):
        return
    joints = {id(b): _joints(b, facts.model) for b in facts.bindings if b.plant == "model"}
    found: set[tuple[Place, Place]] = set()
    for subsystem in facts.subsystems:
        devices = {wire.name for wire in facts.wires.of(subsystem) if wire.device}
        own = [b for b in facts.bindings if b.binding.device in devices and joints.get(id(b))]
        own.sort(key=lambda bound: not bound.is_commanded)
        for one, other in combinations(own, 2):
            first, second = joints[id(one)], joints[id(other)]
            places = one.binding.place, other.binding.place
            if first != second and sorted(first) == sorted(second) and places not in found:
                found.add(places)
                yield _two_orders(one, first, other, second)


def _joints(bound: BoundElement, model: Model) -> list[str]:
    """The joint of each number; none where they do not map to one joint each."""
    binding = bound.binding
    found = [] if bound.is_commanded else [*binding.joints]
    for name in () if bound.is_commanded else binding.sensors:
        part = model.parts.get(("sensor", name), ModelPart(""))
        found.append(part.joint or model.driven(part.actuator))
    found += [model.driven(name) for name in binding.actuators]
    single = all(model.joint_kind(joint) in ("hinge", "slide") for joint in found)
    return found if single and not binding.through and len(set(found)) == len(found) > 1 else []


def _two_orders(
    one: BoundElement, first: list[str], other: BoundElement, second: list[str]
) -> Diagnostic:
    """The element of which another one has the joints in another order."""
    binding = other.binding
    names = [name for kind in _KINDS for name in getattr(binding, kind)]
    kinds = [kind for kind in _KINDS if getattr(binding, kind)]
    if other.is_commanded:
        names, kinds = [*binding.actuators], ["actuators"]
    help = "list them in one order"
    if len(kinds) == 1:
        wanted = ", ".join(names[second.index(joint)] for joint in first)
        help += f": `{kinds[0]}: [{wanted}]`"
    both = f"`{one.element.name}`", f"`{other.element.name}`"
    return Diagnostic(
        "W0513",
        f"{both[0]} has the joints in the order `{', '.join(first)}`, and {both[1]} has "
        f"them as `{', '.join(second)}`",
        binding.place.below(kinds[0]),
        related=(Related(one.binding.place, f"in the order `{', '.join(first)}`"),),
        help=help,
    )


_KINDS = ("joints", "sensors", "actuators")
