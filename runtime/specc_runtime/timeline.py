"""The static timeline: who steps and what is sampled at each base tick of the hyperperiod."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

LONGEST = 1_000_000
"""Ticks of the longest table that is worth its memory (about 8 MB)."""


@dataclass(frozen=True, slots=True)
class SensorRate:
    """A sensor with a new sample every `ticks`, or whenever one of its readers is due if 0."""

    ticks: int
    readers: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Slot:
    """Names of the subsystems that are due, sorted, and of the sensors to sample for them."""

    subsystems: tuple[str, ...]
    sensors: tuple[str, ...] = ()


def timeline(
    ticks: Mapping[str, int], sensors: Mapping[str, SensorRate] | None = None
) -> tuple[Slot, ...]:
    """The slots of one hyperperiod, for subsystems that are due every so many ticks from tick 0 on.

    Sensors stay in the order given. Raises ValueError when the rates have no common period that is
    worth a table.
    """
    sensors = sensors or {}
    length = hyperperiod([*ticks.values(), *(s.ticks for s in sensors.values() if s.ticks)])
    names = sorted(ticks)
    sampled = {name: _sample_ticks(rate, ticks, length) for name, rate in sensors.items()}
    known: dict[Slot, Slot] = {}
    table = []
    for tick in range(length):
        slot = Slot(
            tuple([name for name in names if tick % ticks[name] == 0]),
            tuple([name for name in sensors if tick in sampled[name]]),
        )
        table.append(known.setdefault(slot, slot))
    return tuple(table)


def hyperperiod(ticks: Iterable[int]) -> int:
    """Least common multiple of the periods; raises ValueError above `LONGEST`."""
    length = math.lcm(*ticks)
    if length > LONGEST:
        raise ValueError(f"the rates meet again only after {length} base ticks")
    return length


def _sample_ticks(rate: SensorRate, ticks: Mapping[str, int], length: int) -> frozenset[int]:
    """A sample is worth taking if somebody is due before the next one."""
    readers = [ticks[name] for name in rate.readers]
    window = rate.ticks or 1
    return frozenset(
        tick for tick in range(0, length, window) if any(-tick % r < window for r in readers)
    )
