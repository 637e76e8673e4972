"""What each binding names fits its element and the model: kinds, names, units, order, poses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, islice

from specc.analysis import Facts
from specc.analysis.plant import (
    FRAME_ORIENTATION,
    FRAME_POSITION,
    BoundElement,
    RawNumbers,
    first_key,
    is_another_unit,
    is_orientation,
    is_quaternion,
    raw_numbers,
)
from specc.analysis.reaching import ReportedScalar, ReportedScalars, ScalarExpr, component
from specc.analysis.reads import ExpressionText, texts
from specc.diagnostics import Diagnostic, Related, nearest, rename_fix, sole_correction
from specc.diagnostics.phrases import counted, join_words, with_article
from specc.lang import show
from specc.lang.builtins import FUNCTIONS
from specc.mjcf import Model, ModelError
from specc.mjcf.model import ModelObject, ModelPart
from specc.model.bindings import PLANT, Binding
from specc.model.expr import Builtin, Expr, walk
from specc.model.requirement import expressions_in
from specc.model.types import Image, Pose
from specc.model.units import Unit
from specc.source import Place

# A commanded element moves actuators; a reported one comes from joints, sensors or a camera.


def bindings_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0505, for a binding whose kind does not suit its element."""
    for bound in facts.bindings:
        complaint = _kind_complaint(bound)
        if complaint:
            message, help = complaint
            related = (_declaration(bound),)
            yield Diagnostic("E0505", message, bound.binding.place, "", related, help)


def _declaration(bound: BoundElement) -> Related:
    return Related(bound.element.place, f"`{bound.element.type}`")


_OF_A_MODEL = (
    "joints", "sensors", "actuators", "camera", "image", "noise", "depth_noise", "through",
)  # fmt: skip

_OF_TOPICS = (
    "topic", "message", "qos", "tf", "action", "action_server", "service", "service_server", "part",
    "field", "when_busy", "answer_within_s",
)  # fmt: skip

_OF_SAMPLES = ("rate_hz", "sporadic", "max_gap_s")


def _kind_complaint(bound: BoundElement) -> tuple[str, str] | None:
    """Why a binding does not suit its element, and a help text; None if it does."""
    if bound.plant in ("", "ros2", "panel"):  # topics and the panel have checks of their own
        return None
    if not bound.is_commanded and (complaint := _sampling_complaint(bound.binding)):
        return complaint
    if topic := first_key(bound.binding, _OF_TOPICS):
        lacking = "name its `topic`"
        if bound.binding.is_of_ros:
            lacking = "say under `plant` which node there is, `ros2: {node: NAME}`"
        return f"`{topic}` is for what is behind ROS 2", f"{lacking}, or delete `{topic}`"
    if bound.plant == "python":
        name = bound.element.name
        modelled = first_key(bound.binding, _OF_A_MODEL)
        if modelled:
            return (
                f"`{modelled}` is for MuJoCo models; the plant in Python "
                f"{'takes' if bound.is_commanded else 'gives'} `{name}` itself",
                f"delete `{modelled}`",
            )
        return _command_measured(bound, _OF_SAMPLES)
    if not bound.is_commanded:
        return _reported_complaint(bound)
    name = bound.element.name
    if not bound.binding.actuators:
        return f"`{name}` is commanded, but moves no actuator", "add `actuators: [...]`"
    kinds = ("sensors", "camera", "image", "noise", "depth_noise")
    return _command_measured(bound, (*kinds, *_OF_SAMPLES)) or _type_without_through(bound)


def _sampling_complaint(binding: Binding) -> tuple[str, str] | None:
    """Why the times of samples are contradictory, and a help text; None if they are fine."""
    if binding.sporadic and binding.rate_hz is not None:
        return (
            "a sporadic device has no rate: its readers look for a sample in each of their periods",
            "delete `rate`; `max_gap` says for how long there may be no new sample",
        )
    if binding.max_gap_s is not None and not binding.sporadic:
        return "`max_gap` is for sporadic devices", "add `sporadic: true`, or delete `max_gap`"
    return None


def _command_measured(bound: BoundElement, kinds: tuple[str, ...]) -> tuple[str, str] | None:
    measured = first_key(bound.binding, kinds) if bound.is_commanded else ""
    if not measured:
        return None
    return (
        f"`{bound.element.name}` is commanded: `{measured}` is for what a device reports",
        f"delete `{measured}`",
    )


def _reported_complaint(bound: BoundElement) -> tuple[str, str] | None:
    binding, name, type_ = bound.binding, bound.element.name, bound.element.type
    numbers = first_key(binding, ("joints", "sensors", "actuators"))
    if not binding.camera:
        if not numbers:
            camera = ", or `camera:`" if binding.device != PLANT else ""
            message = f"`{name}` is reported, but nothing measures it"
            return message, f"add `joints:` or `sensors:`{camera}"
        if binding.image:
            return f"`image` of `{name}` needs a camera", "add `camera:`"
        return _type_without_through(bound)
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


# A loss is answered that can be seen: silence, or an action without a server.


def losses_answered(facts: Facts) -> Iterator[Diagnostic]:
    """E0505, for an `on_loss` that nothing leads to."""
    for bound in facts.bindings:
        if bound.binding.on_loss is not None and (complaint := _loss_complaint(bound)):
            message, help = complaint
            place = bound.binding.place.below("on_loss")
            yield Diagnostic("E0505", message, place, related=(_declaration(bound),), help=help)


def _loss_complaint(bound: BoundElement) -> tuple[str, str] | None:
    """Why a binding has no `on_loss`, and a help text; None if it has."""
    binding, name = bound.binding, bound.element.name
    if bound.plant in ("", "panel") or bound.is_commanded:  # other checks tell of these
        return None
    call, _ = binding.call
    if not call:
        if binding.max_gap_s is not None:
            return None
        missing = "max_gap: TIME" if bound.plant == "ros2" else "sporadic: true, max_gap: TIME"
        return f"nothing says when `{name}` is lost", f"add `{missing}`, or delete `on_loss`"
    if call != "action":
        why = f"`{name}` is a part of {with_article(call.replace('_', ' '))}, whose loss is none"
        return why, "delete `on_loss`"
    if binding.part != "status":
        why = f"`{name}` is no status, which tells that the server of an action is lost"
        return why, "move `on_loss` to the binding with `part: status`"
    if binding.max_gap_s is not None:
        why = f"`{name}` is lost with its server, and a status that stays has no samples"
        return why, "delete `max_gap`"
    return None


# The joints, sensors, actuators and cameras that bindings name are in the model.


def model_names_known(facts: Facts) -> Iterator[Diagnostic]:
    """E0502, for names that the model lacks; `bindings_fit` reports bindings of the wrong kind."""
    model, plant = facts.model, facts.system.plant
    if plant is None or not isinstance(model, Model) or not model.complete:
        return
    unfit = [b.binding for b in facts.bindings if b.plant == "ros2" or _kind_complaint(b)]
    parts = {"joints": model.joints, "sensors": model.sensors, "actuators": model.actuators}
    for binding in (binding for binding in plant.bindings if binding not in unfit):
        for key, known in parts.items():
            for index, name in enumerate(getattr(binding, key)):
                if name not in known:
                    place = binding.place.below(key, index)
                    yield _unknown_name(place, key.removesuffix("s"), name, known)
        if binding.camera and binding.camera not in model.cameras:
            place = binding.place.below("camera")
            yield _unknown_name(place, "camera", binding.camera, model.cameras)


def _unknown_name(place: Place, kind: str, name: str, known: Mapping[str, object]) -> Diagnostic:
    close = nearest(name, known)
    hint = "did you mean " + " or ".join(f"`{n}`" for n in close) + "?"
    if not close:
        hint = "it has " + (", ".join(f"`{n}`" for n in list(known)[:8]) or f"no {kind}s")
    fix = rename_fix(place, name, sole_correction(name, close))
    return Diagnostic("E0502", f"the model has no {kind} `{name}`", place, help=hint, fix=fix)


# A binding names what measures or takes the element's quantity, each once.


_KINDS = ("joints", "sensors", "actuators")


def bindings_agree(facts: Facts) -> Iterator[Diagnostic]:
    """E0511 for units that differ from the plant's, E0505 for parts listed twice.

    See also `bindings_fit`.
    """
    model = facts.model
    for bound in facts.bindings:
        if _kind_complaint(bound):
            continue
        # An actuator that is commanded twice is `actuators_driven_once`'s matter.
        for kind in _KINDS[:2] if bound.is_commanded else _KINDS:
            names = getattr(bound.binding, kind)
            for index, name in enumerate(names):
                if name in names[:index]:
                    first = bound.binding.place.below(kind, names.index(name))
                    yield Diagnostic(
                        "E0505",
                        f"{kind.removesuffix('s')} `{name}` is listed twice",
                        bound.binding.place.below(kind, index),
                        related=(Related(first, "listed here already"),),
                        help="name another one, or delete it",
                    )
        if isinstance(model, Model):
            yield from _units_differ(bound, model)


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
                verb = "takes" if bound.is_commanded else "gives"
                kind = raw.kind.removesuffix("s")
                yield Diagnostic(
                    "E0511",
                    f"`{bound.element.name}` is in {unit}, and {kind} `{raw.name}` {verb} {other}",
                    bound.binding.place.below(raw.kind, raw.index),
                    related=(_declaration(bound),),
                    help="name another one, or a function under `through:` that converts",
                )
                break
        start += len(raw.units)


# A distance that is measured is a number also where there is nothing to measure.


def distances_bounded(facts: Facts) -> Iterator[Diagnostic]:
    """W0515, of a range finder without a cutoff and without `through`."""
    for bound in facts.bindings:
        binding = bound.binding
        if not isinstance(facts.model, Model) or binding.through or _kind_complaint(bound):
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
    """E0505, for noise in another unit or count than what is measured; see also `bindings_fit`."""
    for bound in facts.bindings:
        binding = bound.binding
        if bound.is_commanded or bound.plant == "panel" or _kind_complaint(bound):
            continue
        if complaint := _noise_complaint(binding):
            message, help = complaint
            yield Diagnostic("E0505", message, binding.place.below("noise"), help=help)
            continue
        for index, unit in enumerate(binding.noise_units):
            measured = _measured_units(bound, facts.model, index)
            if measured and unit not in measured:
                units = join_words(dict.fromkeys(map(str, measured)), "and")
                yield Diagnostic(
                    "E0505",
                    f"noise of sensor `{binding.sensors[index]}` is in {unit}, but "
                    f"the sensor gives {units}",
                    binding.place.below("noise", *((index,) if len(binding.noise) > 1 else ())),
                    related=() if binding.through else (_declaration(bound),),
                    help="write the standard deviation in the unit of what is measured",
                )


def _noise_complaint(binding: Binding) -> tuple[str, str] | None:
    if binding.depth_noise and binding.depth_noise not in DEPTH_NOISES:
        return f"there is no noise called `{binding.depth_noise}`", "write `noise: kinect`"
    if binding.depth_noise and binding.image != "depth":
        return f"noise `{binding.depth_noise}` is for depth images", "delete it"
    given, sensors = len(binding.noise), len(binding.sensors)
    if given and given != sensors:
        message = f"{counted(given, 'standard deviation')} for {counted(sensors, 'sensor')}"
        return message, "give one for each of `sensors:`; joints and actuators have no noise"
    return None


def _measured_units(
    bound: BoundElement, model: Model | ModelError | None, sensor: int
) -> list[Unit]:
    """Units of what a sensor gives, and of what the element has there; none if not known.

    Where the two differ, that is `bindings_agree`'s matter.
    """
    wanted = () if bound.binding.through else bound.units or ()
    start: int | None = 0
    for raw in raw_numbers(bound, model) if isinstance(model, Model) else ():
        if raw.kind == "sensors" and raw.index == sensor:
            units = raw.units or ()
            of_element = () if start is None else wanted[start : start + len(units)]
            return [
                unit for unit in (*units, *(of_element or _common_unit(wanted))) if unit is not None
            ]
        start = None if start is None or raw.units is None else start + len(raw.units)
    return _common_unit(wanted)


def _common_unit(units: Sequence[Unit]) -> list[Unit]:
    """The common unit of some numbers, if they have one."""
    return list(units[:1]) if len(set(units)) == 1 else []


# Within a binding: `through` gets joints and sets actuators.


def joints_like_actuators(facts: Facts) -> Iterator[Diagnostic]:
    """W0513, for joints that are not listed in the order of the actuators that drive them."""
    for bound in facts.bindings:
        model, place = facts.model, bound.binding.place
        if not (bound.is_commanded and bound.plant == "model" and isinstance(model, Model)):
            continue
        joints = bound.binding.joints
        driven = [model.driven(name) for name in bound.binding.actuators]
        wanted = [name for name in driven if name in joints]
        found = [name for name in joints if name in driven]
        if len(set(wanted)) < len(wanted) or len(set(found)) < len(found):
            continue
        differing = ((a, b) for a, b in zip(found, wanted, strict=True) if a != b)
        for name, other in islice(differing, 1):
            index = driven.index(other)
            actuator = bound.binding.actuators[index]
            yield Diagnostic(
                "W0513",
                f"joint `{name}` is listed where actuator `{actuator}` drives `{other}`",
                place.below("joints", joints.index(name)),
                related=(Related(place.below("actuators", index), f"drives `{other}`"),),
                help=f"list both in the same order: `joints: [{', '.join(wanted)}]`",
            )


# Between bindings: elements of one subsystem are vectors over the same joints.


def elements_in_one_order(facts: Facts) -> Iterator[Diagnostic]:
    """W0513, of the elements of all devices that one subsystem works with."""
    if not isinstance(facts.model, Model):
        return
    joints = {id(b): _joints(b, facts.model) for b in facts.bindings if b.plant == "model"}
    found: set[tuple[Place, Place]] = set()
    for subsystem in facts.subsystems:
        devices = {wire.peer_name for wire in facts.wires.wires_of(subsystem) if wire.peer_device}
        own = [b for b in facts.bindings if b.binding.device in devices and joints.get(id(b))]
        own.sort(key=lambda bound: not bound.is_commanded)
        for one, other in combinations(own, 2):
            first, second = joints[id(one)], joints[id(other)]
            places = one.binding.place, other.binding.place
            if first != second and sorted(first) == sorted(second) and places not in found:
                found.add(places)
                binding = other.binding
                names = [name for kind in _KINDS for name in getattr(binding, kind)]
                kinds = [kind for kind in _KINDS if getattr(binding, kind)]
                if other.is_commanded:
                    names, kinds = [*binding.actuators], ["actuators"]
                help = "list them in one order"
                if len(kinds) == 1:
                    wanted = ", ".join(names[second.index(joint)] for joint in first)
                    help += f": `{kinds[0]}: [{wanted}]`"
                yield Diagnostic(
                    "W0513",
                    f"`{one.element.name}` has the joints in the order `{', '.join(first)}`, "
                    f"and `{other.element.name}` has them as `{', '.join(second)}`",
                    binding.place.below(kinds[0]),
                    related=(Related(one.binding.place, f"in the order `{', '.join(first)}`"),),
                    help=help,
                )


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


# A pose is made of the position and the orientation of one thing in one frame.


_WAY = (
    "name a `framepos` and a `framequat` sensor of one thing, in this order, or a free joint: "
    "`sensors: [position, orientation]`"
)


def poses_measured(facts: Facts) -> Iterator[Diagnostic]:
    """E0524, for a pose whose frames are not those that the sensors of the model measure."""
    for bound in facts.bindings:
        if bound.is_pose and isinstance(facts.model, Model) and not bound.binding.camera:
            model = facts.model
            raw = (((raw.kind.removesuffix("s"), raw.name)) for raw in raw_numbers(bound, model))
            parts = [model.parts.get(key) for key in raw]
            known = [part for part in parts if part is not None]
            if parts and len(known) == len(parts) and [part.kind for part in known] != ["free"]:
                yield from _pose_findings(bound, known)


def _pose_findings(bound: BoundElement, parts: list[ModelPart]) -> Iterator[Diagnostic]:
    binding, type_, related = bound.binding, bound.element.type, (_declaration(bound),)
    kinds = [part.kind for part in parts]
    if kinds != [FRAME_POSITION, FRAME_ORIENTATION]:
        wanted = f"`{FRAME_POSITION}, {FRAME_ORIENTATION}`"
        message = f"`{bound.element.name}` is a pose, which takes {wanted}, not"
        message += f" `{', '.join(kinds)}`"
        yield Diagnostic("E0524", message, binding.place, related=related, help=_WAY)
        return
    position, orientation = parts
    one, other = binding.sensors
    for of, verb in (("object", "measures"), ("reference", "measures in")):
        first, second = _object_phrase(position, of), _object_phrase(orientation, of)
        if first != second:
            message = f"sensor `{one}` {verb} {first}, and `{other}` {verb} {second}"
            help = "name the position and the orientation of one thing in one frame"
            place = binding.place.below("sensors", 1)
            yield Diagnostic("E0524", message, place, related=related, help=help)
            return
    if not isinstance(type_, Pose):
        return
    # The frames may have the names of object and reference, the other way round.
    named = [each and each[1] for each in (position.object, position.reference)]
    frames = [type_.child, type_.parent]
    if not _some_frame_agrees(frames, named) and _some_frame_agrees(frames[::-1], named):
        child, reference = (_object_phrase(position, of) for of in ("object", "reference"))
        message = f"the sensors give the pose of {child} in {reference}, not the other way round"
        help = f"make the type `pose[{type_.child}, {type_.parent}]`, and `inverse` it in its uses"
        yield Diagnostic("E0524", message, binding.place, related=related, help=help)


def _object_phrase(part: ModelPart, of: str) -> str:
    found: ModelObject | None = getattr(part, of)
    return "the world" if found is None else f"{found[0]} `{found[1]}`"


def _some_frame_agrees(frames: Sequence[str], named: Sequence[str | None]) -> bool:
    """Whether at least one frame has the name that the model has in its place."""
    return any(one == other for one, other in zip(frames, named, strict=True))


# `pose` takes a quaternion as x, y, z, w; MuJoCo gives w, x, y, z.


def quaternions_ordered(facts: Facts) -> Iterator[Diagnostic]:
    """E0341, for a function that is given the numbers of a quaternion in MuJoCo's order."""
    model = facts.model
    if not isinstance(model, Model):
        return
    bindings: dict[str, BoundElement] = {}
    quaternions: dict[ReportedScalar, tuple[tuple[str, RawNumbers], int]] = {}
    for bound in facts.bindings:
        if bound.binding.through or bound.plant != "model" or bound.is_commanded or bound.is_pose:
            continue
        element, start = f"{bound.binding.device}.{bound.binding.element}", 0
        bindings.setdefault(element, bound)
        for raw in raw_numbers(bound, model):
            for index in range(len(raw.units or ())):
                if is_quaternion(raw, model):
                    quaternions[ReportedScalar(element, start + index)] = (element, raw), index
            start += len(raw.units or ())
    seen: set[Place] = set()
    for subsystem, text, expr in _quaternion_arguments(facts) if quaternions else ():
        place = text.place(expr)
        if place in seen:
            continue
        sources = []
        for index in range(4):
            scalar = ScalarExpr(subsystem, component(expr, index), text)
            found = ReportedScalars(facts.definitions).of(scalar)
            known = [quaternions[each] for each in found if each in quaternions]
            sources.append({source for source, at in known if at == index})
        if common := set.intersection(*sources):
            seen.add(place)
            element, raw = min(common, key=lambda source: source[0])
            shown, kind = show(expr), raw.kind.removesuffix("s")
            help = "reorder it"
            if shown.replace(".", "").isidentifier():
                help += f": `[{', '.join(f'{shown}[{i}]' for i in (1, 2, 3, 0))}]`"
            if is_orientation(raw, model):
                bind = f"bind an element of type `pose[...]` to the position and `{raw.name}`"
                help = f"{bind}, or {help}"
            gives = bindings[element].binding.place.below(raw.kind, raw.index)
            yield Diagnostic(
                "E0341",
                f"`{shown}` has the order w, x, y, z of {kind} `{raw.name}`, "
                "and x, y, z, w are taken",
                place,
                related=(Related(gives, "gives w, x, y, z"),),
                help=help,
            )


def _quaternion_arguments(facts: Facts) -> Iterator[tuple[str, ExpressionText, Expr]]:
    """The quaternions that functions are given, with the subsystem and text that they stand in."""
    every = [(s.qualified_name, text) for s in facts.subsystems for text in texts(s)]
    for item in facts.system.formulas:
        parts = expressions_in(item.formula)
        every += [("", ExpressionText(part, item.place, "")) for part in parts]
    for subsystem, text in every:
        for node in walk(text.expr):
            if isinstance(node, Builtin) and (index := FUNCTIONS[node.name].direction) is not None:
                yield subsystem, text, node.args[index]
