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
    """A sensor whose rate does not go with those of `readers`, or with none of all `tick`s."""

    bound: Bound
    rate_hz: Fraction
    readers: tuple[Subsystem, ...]
    tick: Fraction


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
    bindings: Iterable[Bound], subsystems: Sequence[Subsystem], *, whole: bool
) -> Iterator[Misfit]:
    """Sensors whose rates do not fit; the base tick is known of a `whole` system only."""
    tick = base_tick(1 / s.rate_hz for s in subsystems) if subsystems else Fraction(1)
    for bound in bindings:
        rate = bound.binding.rate_hz
        if rate is None or bound.commanded:
            continue
        readers = tuple(s for s in subsystems if _reads(s, bound) and not _goes(rate, s.rate_hz))
        if readers or (whole and (1 / rate / tick).denominator != 1):
            yield Misfit(bound, rate, readers, tick)


def _ticks(subsystems: Sequence[Subsystem]) -> Fraction:
    periods = [1 / s.rate_hz for s in subsystems]
    return hyperperiod(periods) / base_tick(periods) if periods else Fraction(1)


def _reads(subsystem: Subsystem, bound: Bound) -> bool:
    device = bound.binding.device
    return any(p.direction == "x" and p.other_end == device for p in subsystem.ports)


def _goes(a: Fraction, b: Fraction) -> bool:
    return (a / b).denominator == 1 or (b / a).denominator == 1
