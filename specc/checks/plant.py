"""Sizes, units, noise and rates of bindings agree with the model of the plant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction

from specc.analysis import Facts
from specc.analysis.plant import Bound, Raw, differs, raw_numbers, units_of, wrong_kind
from specc.analysis.words import below, listed
from specc.diagnostics import Diagnostic, Related
from specc.mjcf import Model, ModelError
from specc.model.system import Binding, System
from specc.model.types import Image, Real, Spatial, Type, Vector
from specc.model.units import Unit

# Without a function in between, an element has as many numbers as what stands behind it.


_DEFAULT_CAMERA = (640, 480)
"""Width and height of images of a camera whose resolution the model does not say."""


def sizes_match(system: System, facts: Facts) -> Iterator[Diagnostic]:
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
                f"`{bound.element.name}` has {sizes[0]}, the plant has {sizes[1]}",
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


# A binding names what measures or takes the element's quantity, each once and in one order.


_LISTS = ("joints", "sensors", "actuators")


def bindings_agree(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0511, E0512, W0513; a binding of the wrong kind is `bindings_fit`'s matter."""
    model = facts.model
    for bound in facts.bindings:
        if wrong_kind(bound):
            continue
        yield from _named_twice(bound)
        if isinstance(model, Model):
            yield from _units_differ(bound, model)
            yield from _disordered(bound, model)


def _named_twice(bound: Bound) -> Iterator[Diagnostic]:
    """An actuator that is commanded twice is `actuators_driven_once`'s matter."""
    for kind in _LISTS[:2] if bound.commanded else _LISTS:
        names = getattr(bound.binding, kind)
        for index, name in enumerate(names):
            if name in names[:index]:
                first = below(bound.binding.place, kind, names.index(name))
                yield Diagnostic(
                    "E0512",
                    f"{kind.removesuffix('s')} `{name}` is listed twice",
                    below(bound.binding.place, kind, index),
                    related=(Related(first, "listed here already"),),
                    help="name another one, or delete it",
                )


def _units_differ(bound: Bound, model: Model) -> Iterator[Diagnostic]:
    wanted = units_of(bound.element.type)
    if bound.binding.through or wanted is None:
        return
    start = 0
    for raw in raw_numbers(bound, model):
        if raw.units is None:
            return
        for unit, other in zip(wanted[start:], raw.units, strict=False):
            if other is not None and differs(raw, other, unit):
                yield _another_unit(bound, raw, unit, other)
                break
        start += len(raw.units)


def _another_unit(bound: Bound, raw: Raw, unit: Unit, other: Unit) -> Diagnostic:
    verb = "takes" if bound.commanded else "gives"
    kind = raw.kind.removesuffix("s")
    return Diagnostic(
        "E0511",
        f"`{bound.element.name}` is in {unit}, and {kind} `{raw.name}` {verb} {other}",
        below(bound.binding.place, raw.kind, raw.place),
        related=(Related(bound.element.place, f"`{bound.element.type}`"),),
        help="name another one, or a function under `through:` that converts",
    )


def _disordered(bound: Bound, model: Model) -> Iterator[Diagnostic]:
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
                f"joint `{name}` stands where actuator `{actuator}` has `{other}`",
                below(place, "joints", listed.index(name)),
                related=(
                    Related(below(place, "actuators", driven.index(other)), f"drives `{other}`"),
                ),
                help=f"list both in the same order: `joints: [{', '.join(both)}]`",
            )
            return


# Noise has one standard deviation per sensor, in its unit; that of the Kinect is for depth images.
#
# Noise is added to what a sensor gives, before any function of `through`.


DEPTH_NOISES = ("kinect",)


def noise_fits(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0510; a binding of the wrong kind is `bindings_fit`'s matter."""
    for bound in facts.bindings:
        binding = bound.binding
        if bound.commanded or wrong_kind(bound):
            continue
        complaint = _depth(binding) or _deviations(binding)
        if complaint:
            message, help_text = complaint
            yield Diagnostic("E0510", message, below(binding.place, "noise"), help=help_text)
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
    deviations = "1 standard deviation" if given == 1 else f"{given} standard deviations"
    message = f"{deviations} for {sensors} {'sensor' if sensors == 1 else 'sensors'}"
    return message, "give one for each of `sensors:`; joints and actuators have no noise"


def _units(bound: Bound, model: Model | ModelError | None) -> Iterator[Diagnostic]:
    binding = bound.binding
    several = len(binding.noise) > 1
    for index, unit in enumerate(binding.noise_units):
        measured = _measured(bound, model, index)
        if measured and unit not in measured:
            said = listed(dict.fromkeys(map(str, measured)), "and")
            yield Diagnostic(
                "E0510",
                (
                    f"noise of sensor `{binding.sensors[index]}` is in {unit}, but "
                    f"the sensor gives {said}"
                ),
                below(binding.place, "noise", *((index,) if several else ())),
                related=() if binding.through else (_type(bound),),
                help="write the standard deviation in the unit of what is measured",
            )


def _type(bound: Bound) -> Related:
    return Related(bound.element.place, f"`{bound.element.type}`")


def _measured(bound: Bound, model: Model | ModelError | None, sensor: int) -> list[Unit]:
    """Units of what a sensor gives, and of what the element has there; none if not known.

    Where the two differ, that is `bindings_agree`'s matter.
    """
    wanted = () if bound.binding.through else units_of(bound.element.type) or ()
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


# The rate of a sensor goes with the timeline and with the rates of its readers.


def sensors_in_time(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0509."""
    for misfit in facts.rates.misfits:
        rate, tick = misfit.rate_hz, misfit.tick_s
        place = below(misfit.bound.binding.place, "rate")
        if not misfit.readers and tick is not None:
            message = f"its period is not a whole number of base ticks of {float(tick):g} s"
            yield Diagnostic("E0509", message, place, help=_fitting(tick, rate))
        for reader in misfit.readers:
            yield Diagnostic(
                "E0509",
                f"{float(rate):g} Hz does not fit the {float(reader.rate_hz):g} Hz of "
                f"`{reader.qualified_name}`",
                place,
                related=(Related(below(reader.place, "rate"), "reads it at this rate"),),
                help="make one rate a whole multiple of the other",
            )


def _fitting(tick: Fraction, rate: Fraction) -> str:
    ticks = max(1, round(1 / rate / tick))
    return f"the nearest period that fits is {float(1000 * ticks * tick):g} ms"


CHECKS = (sizes_match, bindings_agree, noise_fits, sensors_in_time)
