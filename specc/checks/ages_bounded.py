"""No value can be older than its reader allows."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import ceil

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.facts.sources import Measured, bounded
from specc.facts.trails import Trail
from specc.facts.words import ms
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """E0410, with the whole way of the oldest value."""
    if facts.broken or facts.faulty or facts.rates.clash or facts.rates.misfits:
        return
    for node, element in bounded(facts):
        oldest, allowed = facts.ages.oldest(node), element.max_age_s
        if isinstance(oldest, Trail) and allowed is not None and oldest.age_s > allowed:
            yield Diagnostic(
                "E0410",
                f"`{node.short}` can be {ms(oldest.age_s)} old",
                below(element.place, "max_age"),
                f"may be {ms(allowed)} old",
                tuple(_way(oldest, facts)),
                f"{_shorten(oldest, facts)}, from which most of it comes, or allow "
                f"{_at_least(oldest.age_s)}",
            )


def _way(oldest: Trail, facts: Facts) -> Iterator[Related]:
    """From the measurement to the reader, with the time that has passed since."""
    hops = oldest.hops()
    first = facts.ages.sources.of(hops[0].node)
    if isinstance(first, Measured):
        often = "sample at least every" if first.sporadic else "sample every"
        every = f", a {often} {ms(first.period_s)}" if first.period_s else ""
        yield Related(first.place, f"measured by `{first.device}`{every}: 0 ms")
    for hop in hops:
        reader = facts.connections.subsystems.get(hop.node.reader)
        if reader is None:
            continue
        rate = f"`{reader.qualified_name}`, {float(reader.rate_hz):g} Hz"
        read_s = hop.read_s - oldest.measured_s
        words = f"{rate}, reads it after {ms(read_s)}"
        if hop is not oldest:
            words += f" and sends a result, seen from {ms(read_s + 1 / reader.rate_hz)} on"
        yield Related(below(reader.place, "rate"), words)


def _at_least(age_s: Fraction) -> str:
    """A length of time that is short to write and not less."""
    scale = 1000
    while age_s * scale < 100 and (age_s * scale).denominator != 1:
        scale *= 10
    return ms(Fraction(ceil(age_s * scale), scale))


def _shorten(oldest: Trail, facts: Facts) -> str:
    """What would make the longest step of the way shorter."""
    steps: list[tuple[Fraction, str]] = []
    for hop in oldest.hops():
        source = facts.ages.sources.of(hop.node)
        before = hop.before.read_s if hop.before else oldest.measured_s
        if isinstance(source, Measured):
            what = "shorten the `max_gap`" if source.sporadic else "raise the rate"
            steps.append((hop.read_s - before, f"{what} of `{source.device}`"))
        elif source is not None:
            way_out = f"raise the rate of `{source.sender.qualified_name}`"
            steps.append((hop.read_s - before, way_out))
    return max(steps, key=lambda step: step[0])[1]
