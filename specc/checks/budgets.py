"""Real time: how long steps may take and agents be silent, and what crosses to other processes."""

from __future__ import annotations

from collections.abc import Iterator

from specc.analysis import Facts
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import ms
from specc.model.system import Device, Subsystem
from specc.model.types import Opaque, Type
from specc.source import Place

# A step is over before the next one is due.


def budgets_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0414."""
    for subsystem in facts.rates.timed:
        budget_s, period_s = subsystem.budget_s, 1 / subsystem.rate_hz
        if budget_s is not None and budget_s > period_s:
            yield Diagnostic(
                "E0414",
                f"steps of `{subsystem.qualified_name}` may take longer than its period",
                subsystem.place.below("budget"),
                f"{ms(budget_s)}, and the next one is due after {ms(period_s)}",
                (Related(subsystem.place.below("rate"), "its rate"),),
                f"choose a period of at least {ms(budget_s)}, or make the steps shorter",
            )


# A subsystem that computes in a process of its own gets and gives values that can cross.


def values_cross(facts: Facts) -> Iterator[Diagnostic]:
    """W0419, for each type without a codec, where it crosses first."""
    for subsystem in facts.rates.timed:
        if _is_apart(subsystem, facts):
            told: set[str] = set()
            for name, type_, place in _crossing(subsystem, facts):
                for opaque in _uncodable(type_):
                    if opaque.name not in told:
                        told.add(opaque.name)
                        yield _finding(subsystem, name, opaque, place)


def _finding(subsystem: Subsystem, name: str, opaque: Opaque, place: Place) -> Diagnostic:
    return Diagnostic(
        "W0419",
        f"values of `{opaque.name}` cannot cross to the process of `{subsystem.qualified_name}`",
        place,
        f"`{name}` has values of an opaque type without a codec",
        (
            Related(
                subsystem.place.below("budget"), "computes in a process of its own in real time"
            ),
        ),
        f"give `{opaque.name}` a `codec`, or the subsystem no `budget`",
    )


def _is_apart(subsystem: Subsystem, facts: Facts) -> bool:
    """Whether its budget is longer than the base tick, in which all others have to be done."""
    return subsystem.budget_s is not None and subsystem.budget_s > facts.rates.tick_s


def _crossing(subsystem: Subsystem, facts: Facts) -> Iterator[tuple[str, Type, Place]]:
    """What a process gets and gives: names, types and places of buffers, and of memory in use."""
    for port in subsystem.ports:
        for element in port.elements:
            name = f"{port.direction}.{port.peer}.{element.name}"
            yield name, element.type, port.place_of(element)
    watched = facts.watched(subsystem)
    for memory in subsystem.memory:
        if memory.name in watched:
            yield memory.name, memory.type, memory.place


def _uncodable(type_: Type) -> Iterator[Opaque]:
    """The opaque types without a codec among the parts of a type."""
    if isinstance(type_, Opaque) and not type_.codec:
        yield type_
    for inner in type_.parts:
        yield from _uncodable(inner)


# An agent may be silent for some time before a device gets its safe outputs.


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
    for subsystem in (wire.subsystem for wire in facts.wires.wires_to(device.qualified_name, "y")):
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


CHECKS = (budgets_fit, silences_are_borne)
USES = (values_cross,)
