"""Noise has one standard deviation per sensor; that of the Kinect is for depth images."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic
from specc.facts import Facts
from specc.facts.kinds import wrong_kind
from specc.facts.places import below
from specc.model.system import Binding, System

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
