"""Which rates go with one another; nothing is concluded from those that do not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from specc.facts.bindings import Bound
from specc.facts.timeline import base_tick, hyperperiod
from specc.model.system import Subsystem

LONGEST = 100_000
"""Base ticks after which the timeline has to repeat."""


@dataclass(frozen=True, slots=True)
class Clash:
    """A subsystem whose rate does not go with those of the others: `ticks` until they repeat."""

    odd: Subsystem
    others: tuple[Subsystem, ...]
    ticks: Fraction


@dataclass(frozen=True, slots=True)
class Misfit:
    """A sensor whose rate does not go with those of `readers`; if none, with the base tick."""

    bound: Bound
    rate_hz: Fraction
    readers: tuple[Subsystem, ...]
    tick_s: Fraction | None


def find_clash(subsystems: Sequence[Subsystem]) -> Clash | None:
    """The subsystem without which the others' timeline repeats in time, or else the last one."""
    ticks = _ticks(subsystems)
    if ticks <= LONGEST:
        return None
    for odd in reversed(subsystems):
        others = tuple(s for s in subsystems if s is not odd)
        if _ticks(others) <= LONGEST:
            return Clash(odd, others, ticks)
    return Clash(subsystems[-1], tuple(subsystems[:-1]), ticks)


def find_misfits(
    bindings: Iterable[Bound], readers: Sequence[Subsystem], tick_s: Fraction | None
) -> Iterator[Misfit]:
    """Sensors whose rates go neither with those of their readers nor with the tick, if known."""
    for bound in bindings:
        rate = bound.binding.rate_hz
        if rate is None or bound.commanded:
            continue
        strangers = tuple(s for s in readers if _reads(s, bound) and not _goes(rate, s.rate_hz))
        if strangers or (tick_s is not None and (1 / rate / tick_s).denominator != 1):
            yield Misfit(bound, rate, strangers, tick_s)


def _ticks(subsystems: Sequence[Subsystem]) -> Fraction:
    periods = [1 / s.rate_hz for s in subsystems]
    return hyperperiod(periods) / base_tick(periods) if periods else Fraction(1)


def _reads(subsystem: Subsystem, bound: Bound) -> bool:
    device = bound.binding.device
    return any(p.direction == "x" and p.other_end == device for p in subsystem.ports)


def _goes(a: Fraction, b: Fraction) -> bool:
    return (a / b).denominator == 1 or (b / a).denominator == 1
