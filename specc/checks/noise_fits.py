"""Noise has one standard deviation per sensor, in its unit; that of the Kinect is for depth images.

Noise is added to what a sensor gives, before any function of `through`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.bindings import Bound
from specc.facts.kinds import wrong_kind
from specc.facts.places import below
from specc.facts.plant_units import raw_numbers, units_of
from specc.facts.words import listed
from specc.mjcf import Model, ModelError
from specc.model.system import Binding, System
from specc.model.units import Unit

DEPTH_NOISES = ("kinect",)


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
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
                f"noise of sensor `{binding.sensors[index]}` is in {unit}, what it gives in {said}",
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
