"""A subsystem that asks whether a value has come is fast enough to see every value."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.facts.references import arrivals_asked
from specc.model.system import Port, Subsystem, System
from specc.source import Place


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0414, for values that are sent on occasion; a value of every period is a measurement."""
    for subsystem in facts.rates.timed:
        asked = arrivals_asked(subsystem)
        for port in subsystem.ports if asked else ():
            for element in port.elements:
                if port.direction == "x" and (port.peer, element.name) in asked:
                    source = _source(subsystem, port, element.name, facts)
                    if source and source[0] > subsystem.rate_hz:
                        rate, place = source
                        yield Diagnostic(
                            "W0414",
                            f"`{subsystem.qualified_name}` can miss values of "
                            f"`x.{port.peer}.{element.name}`",
                            element.place,
                            f"up to {_count(rate / subsystem.rate_hz)} values come between two "
                            f"periods of {_ms(subsystem.rate_hz)}, and the last one is seen",
                            (
                                Related(place, f"sends one every {_ms(rate)}"),
                                Related(below(subsystem.place, "rate"), "looks at this rate"),
                            ),
                            "raise the rate of the reader, or lower that of the sender",
                        )


def _source(
    subsystem: Subsystem, port: Port, element: str, facts: Facts
) -> tuple[Fraction, Place] | None:
    """How often the element can be sent, and where that is said; None if it always is."""
    misfits = [misfit.bound.binding for misfit in facts.rates.misfits]
    for bound in facts.bindings:
        rate = bound.binding.rate_hz
        if (bound.binding.device, bound.element.name) == (port.other_end, element) and rate:
            fits = bound.binding not in misfits
            return (rate, below(bound.binding.place, "rate")) if fits else None
    sender = facts.connections.subsystems.get(port.other_end)
    end = facts.connections.other_port(subsystem, port)
    unsure = facts.broken | facts.faulty
    if sender is None or end is None or port.other_end in unsure:
        return None
    behaviours = {state.behaviour.name: state.behaviour for state in sender.states}.values()
    writing = [
        any((a.peer, a.name) == (end.peer, element) for a in b.assignments) for b in behaviours
    ]
    return None if all(writing) else (sender.rate_hz, below(sender.place, "rate"))


def _count(ratio: Fraction) -> int:
    return -(-ratio.numerator // ratio.denominator)


def _ms(rate: Fraction) -> str:
    return f"{float(1000 / rate):g} ms"
