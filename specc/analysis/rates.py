"""Rates that fit together; nothing is concluded from those that do not."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import gcd, lcm

from specc.analysis.plant import BoundElement
from specc.model.system import Subsystem
from specc.model.wires import Wires

LONGEST = 100_000
"""Base ticks after which the timeline has to repeat."""


def base_tick(periods_s: Iterable[Fraction]) -> Fraction:
    """The longest time in seconds of which all periods are whole multiples; 1 if there are none."""
    listed = list(periods_s) or [Fraction(1)]
    return Fraction(gcd(*(p.numerator for p in listed)), lcm(*(p.denominator for p in listed)))


@dataclass(frozen=True, slots=True)
class TimelineClash:
    """A subsystem whose rate does not fit the others: the timeline repeats after `ticks`."""

    subsystem: Subsystem
    others: tuple[Subsystem, ...]
    ticks: Fraction


@dataclass(frozen=True, slots=True)
class RateConflict:
    """A sensor whose rate does not fit those of `readers` or, without readers, the base tick."""

    bound: BoundElement
    rate_hz: Fraction
    readers: tuple[Subsystem, ...]
    tick_s: Fraction | None


class Rates:
    """The rates of a system and of those `subsystems` that have no errors.

    The system `is_complete` if all errors are inside subsystems and devices.
    """

    def __init__(
        self,
        wires: Wires,
        subsystems: Sequence[Subsystem],
        bindings: Sequence[BoundElement],
        *,
        is_complete: bool,
    ) -> None:
        self._every = tuple(wires.subsystems.values())
        self._wires = wires
        self._subsystems = subsystems
        self._bindings = bindings
        self._is_complete = is_complete

    @cached_property
    def clash(self) -> TimelineClash | None:
        """The clash if the timeline takes more than `LONGEST` ticks to repeat.

        It names the last subsystem without which the others fit, or the last of all. Only
        subsystems with known rates count.
        """
        rated = [s for s in self._every if s.has_rate]
        ticks = _ticks(rated)
        if ticks <= LONGEST:
            return None
        without = [(odd, tuple(s for s in rated if s is not odd)) for odd in reversed(rated)]
        fitting = (pair for pair in without if _ticks(pair[1]) <= LONGEST)
        return TimelineClash(*next(fitting, without[0]), ticks)

    @cached_property
    def timed(self) -> tuple[Subsystem, ...]:
        """The subsystems with rates, if these fit together."""
        return () if self.clash else tuple(s for s in self._subsystems if s.has_rate)

    @cached_property
    def tick_s(self) -> Fraction:
        """The base tick of the timed ones; 1 s if there are none."""
        return base_tick(1 / s.rate_hz for s in self.timed)

    @cached_property
    def conflicts(self) -> tuple[RateConflict, ...]:
        """Sensors whose rates fit neither those of their readers nor the tick, if that is known."""
        found = (self._conflict(bound) for bound in self._bindings)
        return tuple(conflict for conflict in found if conflict is not None)

    def _conflict(self, bound: BoundElement) -> RateConflict | None:
        rate, device, tick_s = bound.binding.rate_hz, bound.binding.device, self._tick_of_all_s
        if rate is None or bound.is_commanded:
            return None
        reading = {wire.subsystem.qualified_name for wire in self._wires.wires_to(device, "x")}
        readers = [s for s in self.timed if s.qualified_name in reading]
        # One rate is to be a whole multiple of the other.
        unfit = tuple(s for s in readers if 1 not in ((rate / s.rate_hz).as_integer_ratio()))
        fits = tick_s is None or (1 / rate / tick_s).denominator == 1
        return None if fits and not unfit else RateConflict(bound, rate, unfit, tick_s)

    @cached_property
    def _tick_of_all_s(self) -> Fraction | None:
        """The base tick, if all rates are known."""
        all_known = self._is_complete and all(s.has_rate for s in self._every)
        if self.clash or not self._every or not all_known:
            return None
        return base_tick(1 / s.rate_hz for s in self._every)


def _ticks(subsystems: Sequence[Subsystem]) -> Fraction:
    """Base ticks after which the timeline of some subsystems repeats."""
    rates = [s.rate_hz for s in subsystems]
    return 1 / base_tick(rates) / base_tick(1 / rate for rate in rates)
