"""For how long an agent may be silent in real time until a device gets its safe outputs."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import ms
from specc.model.system import Device


def silences_are_borne(facts: Facts) -> Iterator[Diagnostic]:
    """E0415, E0416, at the silence of a device."""
    for device in facts.system.devices:
        if device.silence_s is None or device.qualified_name in facts.broken:
            continue
        if device.safe:
            yield from _too_short(device, facts)
        else:
            yield Diagnostic(
                "E0416",
                f"`{device.qualified_name}` has no safe output that it could get after a silence",
                device.place.below("silence"),
                help="declare one, `x: {u: {type: ..., safe: ...}}`, or delete `silence`",
            )


def _too_short(device: Device, facts: Facts) -> Iterator[Diagnostic]:
    assert device.silence_s is not None
    for subsystem in (wire.subsystem for wire in facts.wires.at(device.qualified_name, "y")):
        period_s = 1 / subsystem.rate_hz
        if device.silence_s <= period_s:
            yield Diagnostic(
                "E0415",
                f"a silence of {ms(device.silence_s)} is not longer than the period of "
                f"`{subsystem.qualified_name}`, {ms(period_s)}",
                device.place.below("silence"),
                related=(Related(subsystem.place.below("rate"), "which commands the device"),),
                help=f"`silence: {ms(2 * period_s)}` bears one period that is skipped",
            )


CHECKS = (silences_are_borne,)
