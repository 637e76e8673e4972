"""How the ticks of a run follow the clock: not at all, at a pace, or in real time."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import Any

from specc_runtime.clock import EndingClock, WallClock
from specc_runtime.options import Options

_GROUPS = 1000
_FINEST = 10**9
"""Parts of a second that base ticks are taken for."""
_EARLY = 1e-6  # of a tick: the clock may be read just before the moment that was waited for


class Timing(ABC):
    """Tells the executor which base tick is next, once it is time for it."""

    is_free = False
    """Whether no clock is followed at all."""
    is_over: Callable[[], bool] = staticmethod(lambda: False)
    """Whether the run has ended while a tick was waited for, which does not come then."""

    @abstractmethod
    def begin(self, tick: int, tick_s: float) -> None:
        """Tick `tick` is now, and ticks of `tick_s` follow."""

    @abstractmethod
    def next(self, tick: int) -> int:
        """Wait for the time of `tick`; returns the tick to go on with, that one or a later one."""


class SimulatedTime(Timing):
    """Goes on at once: a run is as fast as the machine."""

    is_free = True

    def begin(self, tick: int, tick_s: float) -> None:
        """See `Timing`."""

    def next(self, tick: int) -> int:
        """See `Timing`."""
        return tick


class Paced(Timing):
    """Simulated time, not faster than `speed` times the clock; no tick is ever skipped.

    Time that was lost is not made up for.
    """

    def __init__(self, clock: WallClock, speed: float = 1.0) -> None:
        self._clock = clock
        self._speed = speed
        self._origin_s = 0.0
        self._tick_s = 0.0

    def begin(self, tick: int, tick_s: float) -> None:
        """See `Timing`."""
        self._tick_s = tick_s / self._speed
        self._origin_s = self._clock.now_s() - tick * self._tick_s

    def next(self, tick: int) -> int:
        """See `Timing`."""
        left_s = self._origin_s + tick * self._tick_s - self._clock.now_s()
        self._origin_s -= min(left_s, 0.0)
        self._clock.wait(left_s)
        return tick


class RealTime(Timing):
    """The ticks of the clock. Ticks that are over are skipped, never made up for.

    `lateness` has for each tick how long after its time the run went on, for skipped ones as well;
    `ticks` counts those that began.
    """

    def __init__(self, clock: WallClock, ready: Callable[[], None] = lambda: None) -> None:
        """`ready` is called when the first steps are made, before the clock counts."""
        self.lateness = Quantiles()
        self.ticks = 0
        self._ready = ready
        self._clock = clock
        self._origin_s: float | None = None
        self._tick_s = 0.0

    def begin(self, tick: int, tick_s: float) -> None:
        """See `Timing`."""
        self._ready()
        self._tick_s = tick_s
        self._origin_s = self._clock.now_s() - tick * tick_s

    @property
    def now_s(self) -> float:
        """Time since tick 0."""
        return 0.0 if self._origin_s is None else self._clock.now_s() - self._origin_s

    def next(self, tick: int) -> int:
        """See `Timing`; before `begin` the next tick is always due."""
        if self._origin_s is None:
            return tick
        due_s = tick * self._tick_s
        self._clock.wait(due_s - self.now_s)
        now_s = self.now_s
        newest = max(tick, math.floor(now_s / self._tick_s + _EARLY))
        self.ticks += 1
        self.lateness.add_overdue(now_s, self._tick_s, range(tick, newest + 1))
        return newest


def timing(
    options: Options,
    plant: Any,
    clock: WallClock,
    is_over: Callable[[], bool],
    ready: Callable[[], None],
) -> Timing:
    """How a run follows the clock, or that of a plant that has one, as ROS may.

    However long a tick is waited for, the run may end meanwhile. For `ready` see `RealTime`.
    """
    own = getattr(plant, "clock_of_run", EndingClock)
    found: Timing
    if options.real_time:
        found = RealTime(own(clock, is_over), ready)
    elif options.speed is not None:
        found = Paced(own(clock, is_over), options.speed)
    else:
        return SimulatedTime()
    found.is_over = is_over
    return found


def meeting(time_s: float, *ticks_s: float) -> float:
    """The first time from then on that is a multiple of all these."""
    parts = [Fraction(tick_s).limit_denominator(_FINEST) for tick_s in ticks_s]
    below = math.gcd(*(part.denominator for part in parts))
    every_s = math.lcm(*(part.numerator for part in parts)) / below
    return math.ceil(time_s / every_s - _EARLY) * every_s


def late_data(lateness: Quantiles) -> dict[str, float]:
    """How late something was, µs: half of it, 99 of 100, and at most."""
    shares = {f"p{share}": 1e6 * lateness.at(share / 100) for share in (50, 99)}
    return {**shares, "max": 1e6 * lateness.longest_s}


class Quantiles:
    """How often durations came, to 2 % of their length, from 1 µs on: small, however many."""

    _STEP = math.log(1.02)
    _LEAST_S = 1e-6

    def __init__(self) -> None:
        self.count = 0
        self.longest_s = 0.0
        self._counts: Counter[int] = Counter()

    def add_overdue(self, now_s: float, period_s: float, periods: range) -> None:
        """Count for each of these periods how long ago it began; many are counted in groups."""
        every = max(1, len(periods) // _GROUPS)
        for number in periods[::every]:
            count = min(every, periods.stop - number)
            self.add(max(0.0, now_s - number * period_s), count)

    def add(self, duration_s: float, count: int = 1) -> None:
        """Count a duration, once or more often."""
        self.count += count
        self.longest_s = max(self.longest_s, duration_s)
        parts = max(duration_s, self._LEAST_S) / self._LEAST_S
        self._counts[math.ceil(math.log(parts) / self._STEP)] += count

    def at(self, share: float) -> float:
        """The duration, s, that this share of all did not exceed; 0 if there are none."""
        for duration_s, until in self._cumulated():
            if until >= share * self.count:
                return min(duration_s, self.longest_s)
        return 0.0

    def _cumulated(self) -> Iterator[tuple[float, int]]:
        until = 0
        for number, count in sorted(self._counts.items()):
            until += count
            yield self._LEAST_S * math.exp(number * self._STEP), until
