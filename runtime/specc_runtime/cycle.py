"""The executor: the work cycle of all subsystems over base ticks, with logical execution time.

What a subsystem computes at its time stamp i becomes visible at its time stamp i + 1, so neither
the order of subsystems nor the speed of the machine can be seen in a run.
"""

from __future__ import annotations

from collections.abc import Iterable

from specc_runtime.blame import Blame
from specc_runtime.clock import WallClock
from specc_runtime.examination import shortcomings
from specc_runtime.faults import Fault, StepAbandoned
from specc_runtime.plant import Plant
from specc_runtime.records import Observer
from specc_runtime.safety import Commands, LastOutput, leave_safe
from specc_runtime.sampling import Onlooker, Sensor
from specc_runtime.system import System
from specc_runtime.track import Track
from specc_runtime.watchdog import frames_of, left
from specc_runtime.wiring import sensor_rates, timeline, tracks, worker_pool


class Executor:
    """Runs a built system, once. `tick` counts base ticks, `faults` is what stopped the run."""

    def __init__(
        self,
        system: System,
        plant: Plant | None = None,
        observers: Iterable[Observer] = (),
        *,
        onlooker: Onlooker | None = None,
        inline: bool = False,
        clock: WallClock | None = None,
    ) -> None:
        """`plant` must be there, and reset, if the system has devices; `inline` forbids workers.

        Raises ValueError if it is not, or lacks a method that the run calls.
        """
        if (system.plant is None) != (plant is None):
            what = "no devices, but was given" if plant else "devices, but was given no"
            raise ValueError(f"system {system.name!r} has {what} plant")
        if plant is not None and (lacking := shortcomings(plant, Plant)):
            raise ValueError(f"the plant, a {type(plant).__name__}, {'; '.join(lacking)}")
        self.tick = 0
        self.faults: list[Fault] = []
        self._abandoned = False
        self._tick_s = system.tick_s
        self._plant = plant
        self._onlooker = onlooker
        self._observers = tuple(observers)
        rates = sensor_rates(system)
        bound = system.plant.sensors if system.plant else ()
        sensors = (
            {b.name: Sensor(b, plant.sample) for b in bound if b.name in rates} if plant else {}
        )
        self._sensors = sensors
        self._safe = system.plant.safe if system.plant else ()
        self._commands: Commands = {}
        slots = timeline({s.subsystem.name: s.ticks for s in system.subsystems}, rates)
        self._pool = None if inline else worker_pool(system)
        self._tracks = tracks(
            system, plant, sensors, self._commands, self._pool, clock or WallClock()
        )
        self._blame = Blame(system, self._tracks)
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
        try:
            time_s = self.time_s
            for sensor in sensors:
                sensor.update(time_s)
            if self._onlooker is not None:
                self._onlooker.look(tick, time_s)
            for track in due:
                for port in track.ports:
                    port.deliver()
            for track in due:
                track.start(tick)
            if self._plant is not None:
                self._plant.advance(self._tick_s)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001  # whatever a plant raises is a fault
            self.faults.append(self._blame.of_plant(error, self.time_s))
            return False
        self.tick = tick + 1
        return True

    def silence(self, element: str, silent: bool) -> None:
        """Let an element of a device have no samples from now on, or have them again."""
        if element in self._sensors:
            self._sensors[element].silent = silent

    def wait(self) -> None:
        """Wait for the steps that are under way, which become visible when they are due."""
        for track in self._tracks.values():
            if track.pending:
                track.runner.outcome()

    def finish(self) -> None:
        """Wait for the steps that are under way and commit them in the order of their time."""
        pending = [track for track in self._tracks.values() if track.pending]
        for track in sorted(pending, key=lambda track: (track.visible_tick, track.name)):
            if self._abandoned:
                return
            self._commit(track)

    def abandon(self, error: BaseException) -> None:
        """Treat the steps that are under way as failed and wait for none, because of this error."""
        if self._abandoned:
            return
        self._abandoned = True
        for track in self._tracks.values():
            subsystem = track.runner.subsystem
            if frames_of(subsystem):
                fault = left(subsystem, error)
                self.faults.append(self._blame.of_step(fault, track, self._tick_s))

    def close(self) -> None:
        """End the worker threads, once what they do is done."""
        if self._pool is not None:
            self._pool.close()

    def __enter__(self) -> Executor:
        return self

    def __exit__(self, *error: object) -> None:
        """Commit what is under way, end the worker threads, leave the plant safe and close it."""
        try:
            self.finish()
        finally:
            self.close()
            self.leave_safe()
            if self._plant is not None:
                self._plant.close()

    def leave_safe(self) -> dict[str, LastOutput]:
        """Give the plant its safe outputs; returns what every element was sent last."""
        if self._plant is None:
            return {}
        return leave_safe(self._safe, self._plant, self._sensors, self._commands)

    def _commit(self, track: Track) -> None:
        try:
            record = track.commit(self._tick_s)
            for observe in self._observers:
                observe(record)
        except Fault as fault:
            self._abandoned |= isinstance(fault, StepAbandoned)
            self.faults.append(self._blame.of_step(fault, track, self._tick_s))
