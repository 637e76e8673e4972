"""The executor: the work cycle of all subsystems over base ticks, with logical execution time.

What a subsystem computes at its time stamp i becomes visible at its time stamp i + 1, so neither
the order of subsystems nor the speed of the machine can be seen in a run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any

from specc_runtime.blame import Blame
from specc_runtime.clock import WallClock
from specc_runtime.examination import shortcomings
from specc_runtime.faults import Fault, StepAbandoned
from specc_runtime.plant import Plant
from specc_runtime.records import Observer
from specc_runtime.safety import Commands, LastOutput, leave_safe
from specc_runtime.sampling import Onlooker, Port, Sensor
from specc_runtime.snapshot import Values
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System
from specc_runtime.track import Track
from specc_runtime.watchdog import frames_of, left
from specc_runtime.wiring import sensor_rates, timeline, tracks, worker_pool

REST_S = 1.0
_ROUNDING = 1e-6  # of a rest; times are multiples of a rounded tick


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
        at_rest: Callable[[], None] = lambda: None,
    ) -> None:
        """`plant` must be there, and reset, if the system has devices; `inline` forbids workers.

        `at_rest` is called about every `REST_S` of simulated time, when nothing is under way.

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
        self._at_rest = at_rest
        self._rest = len(slots) * max(1, round(REST_S / (len(slots) * self._tick_s)))

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
        if not self.settle():
            return False
        if tick % self._rest == 0:
            self._at_rest()
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

    def rest_before(self, time_s: float) -> float:
        """The last simulated time until then at which all subsystems are due."""
        rest_s = len(self._table) * self._tick_s
        return math.floor(time_s / rest_s + _ROUNDING) * rest_s

    def settle(self) -> bool:
        """Commit the steps that are due now. False after a fault."""
        for track in self._table[self.tick % len(self._table)][0]:
            if track.pending:
                self._commit(track)
        return not self.faults

    def saved(self, values: Values) -> dict[str, Any]:
        """What goes on between the subsystems, at rest; raises NotRecorded.

        All subsystems are due now, so what they sent is in their buffers, and of sensors there are
        new samples to come.
        """
        return {
            "tick": self.tick,
            "stamps": {name: track.stamp for name, track in self._tracks.items()},
            "sensors": {
                name: sensor.saved(partial(values.told, "sensor"), whole=values.is_lenient)
                | {"had": [n for n, ports in self._ports if any(p.has_had(name) for p in ports)]}
                for name, sensor in self._sensors.items()
            },
            "commands": {
                name: {"by": by, "value": values.told("actuator", name, value)}
                for name, (by, value) in self._commands.items()
            },
        }

    def restore(self, saved: Any, values: Values) -> None:
        """Go on from there, with the devices that there are.

        Raises LookupError, TypeError, ValueError for other data.
        """
        self.tick = round(saved["time"] / self._tick_s)
        for track in self._tracks.values():
            track.stamp = -(-self.tick // track.ticks) - 1
        for name, sensor in self._sensors.items():
            if name in saved["sensors"]:
                sensor.restore(saved["sensors"][name], partial(values.value, "sensor"))
        for reader, ports in self._ports:
            for port in ports:
                held = saved["sensors"].get(port.sensor, {})
                port.restore(reader in held.get("had", ()))
        for name, told in saved["commands"].items():
            if not values.has("actuator", name):
                continue
            value = values.value("actuator", name, told["value"])
            self._commands[name] = str(told["by"]), value
            if self._plant is not None:
                self._plant.actuate(name, value)

    @property
    def _ports(self) -> list[tuple[str, tuple[Port, ...]]]:
        """Of every subsystem."""
        return [(name, track.ports) for name, track in self._tracks.items()]

    def inboxes(self) -> Iterator[tuple[Subsystem, Any]]:
        """All subsystems, each with the inputs of its next step."""
        runners = [track.runner for track in self._tracks.values()]
        return ((runner.subsystem, runner.inbox) for runner in runners)

    @property
    def renewed(self) -> frozenset[str]:
        """The sensors of which there is a new sample when their readers are due now."""
        return frozenset(name for name, sensor in self._sensors.items() if sensor.is_renewed)

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
