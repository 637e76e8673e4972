"""The rate of a sensor goes with the timeline and with the rates of its readers."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0509."""
    for misfit in facts.rates.misfits:
        rate, tick = misfit.rate_hz, misfit.tick_s
        place = below(misfit.bound.binding.place, "rate")
        if not misfit.readers and tick is not None:
            message = f"its period is no whole number of base ticks of {float(tick):g} s"
            yield Diagnostic("E0509", message, place, help=_fitting(tick, rate))
        for reader in misfit.readers:
            yield Diagnostic(
                "E0509",
                f"{float(rate):g} Hz does not go with the {float(reader.rate_hz):g} Hz of "
                f"`{reader.qualified_name}`",
                place,
                related=(Related(below(reader.place, "rate"), "reads it at this rate"),),
                help="make one rate a whole multiple of the other",
            )


def _fitting(tick: Fraction, rate: Fraction) -> str:
    ticks = max(1, round(1 / rate / tick))
    return f"the nearest period that fits is {float(1000 * ticks * tick):g} ms"
