"""The rate of a sensor goes with the timeline and with the rates of its readers."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.bindings import Bound
from specc.facts.places import below
from specc.facts.timeline import base_tick
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0509."""
    if facts.broken or facts.faulty or not facts.subsystems:
        return
    tick = base_tick(1 / s.rate_hz for s in facts.subsystems)
    for bound in facts.bindings:
        rate = bound.binding.rate_hz
        if rate is None or bound.commanded:
            continue
        place = below(bound.binding.place, "rate")
        readers = _readers(bound, facts)
        strangers = [r for r in readers if not _goes_with(rate, r.rate_hz)]
        if not strangers and (1 / rate / tick).denominator != 1:
            message = f"its period is no whole number of base ticks of {float(tick):g} s"
            yield Diagnostic("E0509", message, place, help=_fitting(tick, rate))
        for reader in strangers:
            yield Diagnostic(
                "E0509",
                f"{float(rate):g} Hz does not go with the {float(reader.rate_hz):g} Hz of "
                f"`{reader.qualified_name}`",
                place,
                related=(Related(below(reader.place, "rate"), "reads it at this rate"),),
                help="make one rate a whole multiple of the other",
            )


def _readers(bound: Bound, facts: Facts) -> list[Subsystem]:
    return [
        s
        for s in facts.subsystems
        if any(p.direction == "x" and p.other_end == bound.binding.device for p in s.ports)
    ]


def _goes_with(a: Fraction, b: Fraction) -> bool:
    return (a / b).denominator == 1 or (b / a).denominator == 1


def _fitting(tick: Fraction, rate: Fraction) -> str:
    ticks = max(1, round(1 / rate / tick))
    return f"the nearest period that fits is {float(1000 * ticks * tick):g} ms"
