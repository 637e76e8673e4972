"""Which rates go with one another; nothing is concluded from those that do not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

from specc.facts.bindings import Bound
from specc.facts.timeline import base_tick, hyperperiod
from specc.model.system import Subsystem, System

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


class Rates:
    """The rates of a system; `asked` are its subsystems without errors, which checks ask about.

    The system is `whole` if all that is wrong with it is wrong inside subsystems and devices.
    """

    def __init__(
        self,
        system: System,
        asked: Sequence[Subsystem],
        bindings: Iterable[Bound],
        *,
        whole: bool,
    ) -> None:
        self._every = system.subsystems
        self._asked = asked
        self._bindings = bindings
        self._whole = whole

    @cached_property
    def clash(self) -> Clash | None:
        """The rate that does not go with the others, of those that are known."""
        return find_clash([s for s in self._every if s.rated])

    @cached_property
    def timed(self) -> tuple[Subsystem, ...]:
        """The subsystems with rates, if these go with one another."""
        return () if self.clash else tuple(s for s in self._asked if s.rated)

    @cached_property
    def misfits(self) -> tuple[Misfit, ...]:
        """Sensors whose rates do not go with the others."""
        return tuple(find_misfits(self._bindings, self.timed, self._base_tick_s()))

    def _base_tick_s(self) -> Fraction | None:
        """The base tick, if all rates are known."""
        all_known = self._whole and all(s.rated for s in self._every)
        if self.clash or not self._every or not all_known:
            return None
        return base_tick(1 / s.rate_hz for s in self._every)


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
