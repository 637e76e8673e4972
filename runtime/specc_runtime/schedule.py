"""Who is due at a base tick: by the static timeline, and in real time after a gap."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain

from specc_runtime.sampling import Sensor
from specc_runtime.track import Track
from specc_runtime.wiring import Slot

LEAST_APART = 0.5 - 1e-6
"""Of its period, by the clock, between the beginnings of two steps of a subsystem in real time."""


class Due:
    """The subsystems and sensors that are due at each tick of a run."""

    def __init__(
        self,
        slots: Sequence[Slot],
        tracks: Mapping[str, Track],
        sensors: Mapping[str, Sensor],
        tick_s: float,
    ) -> None:
        """`slots` are those of one hyperperiod; ticks that are alike share a row."""
        rows = {
            slot: (
                tuple([tracks[name] for name in slot.subsystems]),
                tuple([sensors[name] for name in slot.sensors]),
            )
            for slot in set(slots)
        }
        self._table = [rows[slot] for slot in slots]
        self._tracks = tuple(tracks.values())
        self._tick_s = tick_s

    @property
    def hyperperiod(self) -> int:
        """Ticks until the same are due again."""
        return len(self._table)

    def at(self, tick: int) -> tuple[Sequence[Track], Iterable[Sensor]]:
        """Who steps, and what is sampled for them."""
        return self._table[tick % len(self._table)]

    def after_gap(self, gap: int, tick: int) -> tuple[Sequence[Track], Iterable[Sensor]]:
        """Who steps at a tick of a run in real time, and what is sampled.

        With the ticks from `gap` on that were skipped before it. A step that is still under way
        goes on.
        """
        due, sensors = self.at(tick)
        if tick > gap:
            rows = [self.at(each) for each in range(max(gap, tick - len(self._table)), tick + 1)]
            sensors = tuple(dict.fromkeys(chain.from_iterable(sampled for _, sampled in rows)))
            owed = [track for track in self._tracks if track.is_owed(gap, tick)]
            due = (*due, *(track for track in owed if track not in due))
        return [track for track in due if not track.is_under_way], sensors

    def is_apart(self, track: Track, now_s: float) -> bool:
        """Whether a step that begins now is far enough from the last one, which may have been late.

        Asked right before the step: steps of others in the same tick take their time.
        """
        return now_s - track.began_s > track.ticks * self._tick_s * LEAST_APART
