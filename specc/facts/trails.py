"""Values on their way through one repetition of the timeline."""

from __future__ import annotations

from fractions import Fraction
from math import lcm
from typing import NamedTuple

from specc.facts.sources import Measured, Node, Sent, Sources
from specc.facts.timeline import base_tick

LONGEST = 100_000
"""Ticks of the longest timeline that is followed; a longer one is refused for its rates."""

Edges = dict[Node, tuple[tuple[Node, bool], ...]]
Need = tuple[int, bool]
"""A time stamp of a reader, and whether only a value that is fresh then counts."""


class Trail(NamedTuple):
    """A value on its way: read at `read_s`, computed from one read before, or measured then."""

    node: Node
    read_s: Fraction
    measured_s: Fraction
    before: Trail | None

    @property
    def age_s(self) -> Fraction:
        """Seconds since the measurement."""
        return self.read_s - self.measured_s

    def hops(self) -> list[Trail]:
        """This one and those before it, the measurement first."""
        found: list[Trail] = []
        trail: Trail | None = self
        while trail is not None:
            found.append(trail)
            trail = trail.before
        return found[::-1]


class Timeline:
    """Follows values through one repetition of the timeline, in whole ticks."""

    def __init__(
        self, sources: Sources, order: list[Node], edges: Edges, periods_s: dict[Node, Fraction]
    ) -> None:
        self._sources = sources
        self._order = order
        self._edges = edges
        measured = {n: s for n in order if isinstance(s := self._sources.of(n), Measured)}
        self._sporadic = {n: s for n, s in measured.items() if s.sporadic}
        samples = {n: s.period_s for n, s in measured.items() if not s.sporadic}
        senders = {
            n: 1 / s.sender.rate_hz for n in order if isinstance(s := self._sources.of(n), Sent)
        }
        every = [p for p in (*periods_s.values(), *samples.values(), *senders.values()) if p]
        self._tick = base_tick(every)
        self._reader = {n: int(p / self._tick) for n, p in periods_s.items()}
        self._sample = {n: int(p / self._tick) for n, p in samples.items()}
        self._sender = {n: int(p / self._tick) for n, p in senders.items()}
        self._repeats = lcm(*(int(p / self._tick) for p in every))
        self._settled = -(-2 * sum(int(p / self._tick) for p in every) // self._repeats)

    def oldest(self, node: Node, on_arrival: bool) -> Trail | None:
        """The oldest value once everything has been sent, on the first time stamp that has it."""
        if self._repeats > LONGEST:
            return None
        start = self._settled * self._repeats
        stamps = range(start, start + self._repeats, self._reader[node])
        wanted: dict[Node, set[Need]] = {n: set() for n in self._order}
        wanted[node] = {(stamp, on_arrival) for stamp in stamps}
        for n in reversed(self._order):
            for need in wanted[n]:
                for stamp in self._computed(n, need):
                    for m, arrival in self._edges[n]:
                        wanted[m].add((stamp, arrival))
        found: dict[tuple[Node, Need], Trail] = {}
        for n in self._order:
            for need in sorted(wanted[n]):
                trail = self._trail(n, need, found)
                if trail is not None:
                    found[n, need] = trail
        trails = [found[node, need] for need in sorted(wanted[node]) if (node, need) in found]
        return max(trails, key=lambda t: (t.age_s, -t.read_s), default=None)

    def _trail(self, n: Node, need: Need, found: dict[tuple[Node, Need], Trail]) -> Trail | None:
        read_s = need[0] * self._tick
        if n in self._sporadic:
            return Trail(n, read_s, read_s - self._since_sample_s(n, on_arrival=need[1]), None)
        if n in self._sample:
            sample = self._sample[n]
            taken = need[0] - need[0] % sample if sample else need[0]
            if need[1] and taken <= need[0] - self._reader[n]:
                return None
            return Trail(n, read_s, taken * self._tick, None)
        reads = [
            trail
            for stamp in self._computed(n, need)
            for m, arrival in self._edges[n]
            if (trail := found.get((m, (stamp, arrival))))
        ]
        if not reads:
            return None
        before = min(reads, key=lambda t: t.measured_s)
        return Trail(n, read_s, before.measured_s, before)

    def _since_sample_s(self, n: Node, *, on_arrival: bool) -> Fraction:
        """How old a sample of a sporadic device can be; another reader may have asked for it."""
        source = self._sporadic[n]
        if not on_arrival:
            return source.period_s
        return self._reader[n] * self._tick if source.shared else Fraction(0)

    def _computed(self, n: Node, need: Need) -> range:
        """The time stamps at which the value may have been computed that is read."""
        source = self._sources.of(n)
        if not isinstance(source, Sent):
            return range(0)
        stamp, on_arrival = need
        period = self._sender[n]
        newest = stamp // period * period - period
        seen_before = stamp - self._reader[n]
        if not on_arrival:
            return range(newest, newest + 1)
        first = (seen_before // period + 1) * period - period
        if source.silent is None:
            first = max(first, newest)
        return range(first, newest + 1, period)
