"""The executor: the work cycle of all subsystems over base ticks, with logical execution time.

What a subsystem computes at its time stamp i becomes visible at its time stamp i + 1, so neither
the order of subsystems nor the speed of the machine can be seen in a run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from specc_runtime.clock import WallClock
from specc_runtime.faults import Fault
from specc_runtime.plant import Plant
from specc_runtime.records import StepRecord
from specc_runtime.sampling import Sensor, sensor_rates
from specc_runtime.system import System
from specc_runtime.timeline import timeline
from specc_runtime.track import Track
from specc_runtime.wiring import tracks, worker_pool

Observer = Callable[[StepRecord], None]
"""Called with each record when it is committed, in an order that is the same in every run."""


class Executor:
    """Runs a built system, once. `tick` counts base ticks, `faults` is what stopped the run."""

    def __init__(
        self,
        system: System,
        plant: Plant | None = None,
        observers: Iterable[Observer] = (),
        *,
        inline: bool = False,
        clock: WallClock | None = None,
    ) -> None:
        """`plant` must be there, and reset, if the system has one; `inline` forbids workers."""
        if (system.plant is None) != (plant is None):
            raise ValueError(f"system {system.name!r} and its plant do not go together")
        self.tick = 0
        self.faults: list[Fault] = []
        self._tick_s = system.tick_s
        self._plant = plant
        self._observers = tuple(observers)
        rates = sensor_rates(system)
        sensors = {name: Sensor(name, plant.sample) for name in rates} if plant else {}
        slots = timeline({s.subsystem.name: s.ticks for s in system.subsystems}, rates)
        self._pool = None if inline else worker_pool(system)
        self._tracks = tracks(system, plant, sensors, self._pool, clock or WallClock())
        rows = {
            slot: (
                tuple(self._tracks[name] for name in slot.subsystems),
                tuple(sensors[name] for name in slot.sensors),
            )
            for slot in set(slots)
        }
        self._table: list[tuple[tuple[Track, ...], tuple[Sensor, ...]]] = [rows[s] for s in slots]

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.tick * self._tick_s

    @property
    def busy_s(self) -> dict[str, float]:
        """Wall time spent in the steps of each subsystem."""
        return {name: track.runner.busy_s for name, track in self._tracks.items()}

    def advance(self) -> bool:
        """One base tick: commit, sample, step, let the plant move. False after a fault."""
        tick = self.tick
        due, sensors = self._table[tick % len(self._table)]
        for track in due:
            if track.pending:
                self._commit(track)
        if self.faults:
            return False
        for sensor in sensors:
            sensor.update()
        for track in due:
            for port in track.ports:
                port.deliver()
        for track in due:
            track.start(tick)
        if self._plant is not None:
            self._plant.advance(self._tick_s)
        self.tick = tick + 1
        return True

    def finish(self) -> None:
        """Wait for the steps that are under way and commit them in the order of their time."""
        pending = [track for track in self._tracks.values() if track.pending]
        for track in sorted(pending, key=lambda track: (track.visible_tick, track.name)):
            self._commit(track)

    def close(self) -> None:
        """End the worker threads, once what they do is done."""
        if self._pool is not None:
            self._pool.shutdown()

    def _commit(self, track: Track) -> None:
        try:
            record = track.commit(self._tick_s)
            for observe in self._observers:
                observe(record)
        except Fault as fault:
            fault.stamp, fault.time_s = track.stamp, track.started_tick * self._tick_s
            self.faults.append(fault)
