"""From a built system to what the executor goes through: the timeline and the tracks.

The timeline is static: who steps and what is sampled at each base tick of the hyperperiod. Every
connection, sensor and actuator becomes a setter.
"""

from __future__ import annotations

import math
import os
import sys
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from specc_runtime.ageing import ageing
from specc_runtime.buffers import Put, lower_flags, setter
from specc_runtime.clock import WallClock
from specc_runtime.faults import DeviceFailed, Fault
from specc_runtime.panel import Panel
from specc_runtime.plant import Plant
from specc_runtime.processes.runner import ProcessRunner
from specc_runtime.processes.worker import Processes
from specc_runtime.safety import Commands
from specc_runtime.sampling import Port, Sensor
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import PlantOutput, System, whole_ticks
from specc_runtime.track import InlineRunner, Runner, Track, WorkerRunner
from specc_runtime.workers import Workers

LONGEST = 1_000_000
"""Ticks of the longest table that is worth its memory (about 8 MB)."""


@dataclass(frozen=True, slots=True)
class SensorRate:
    """A sensor with a new sample every `ticks`, or whenever one of its readers is due if 0."""

    ticks: int
    readers: tuple[str, ...]

    def last_before(self, tick: int) -> int:
        """The tick of the last sample until then, if it is worth taking."""
        return tick - tick % (self.ticks or 1)


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


def sensor_rates(system: System) -> dict[str, SensorRate]:
    """The sensors that somebody reads, in the order in which the plant lists them.

    Raises ValueError for a rate that is no whole number of base ticks.
    """
    if system.plant is None:
        return {}
    rates = {}
    for binding in system.plant.sensors:
        readers = [i.subsystem for i in system.plant.inputs if i.sensor == binding.name]
        if readers:
            rate_hz = binding.rate_hz
            ticks = 0 if rate_hz is None else whole_ticks(1.0 / rate_hz, system.tick_s)
            rates[binding.name] = SensorRate(ticks, tuple(readers))
    return rates


def sensors_read(
    system: System,
    plant: Plant | None,
    panel: Panel,
    read: Collection[str],
    now_s: Callable[[], float],
) -> dict[str, Sensor]:
    """The sensors that somebody reads; `now_s` gives the time of the run."""
    sensors = {}
    for binding in system.plant.sensors if system.plant is not None else ():
        source = plant if binding.panel is None else panel
        if binding.name in read and source is not None:
            sensors[binding.name] = Sensor(binding, source.sample, now_s)
    return sensors


def buttons_read(system: System) -> dict[str, list[str]]:
    """Of each subsystem, the buttons that it reads: a press is read once."""
    buttons: dict[str, list[str]] = {}
    pressed = {element.name for element in system.panel if element.is_event}
    for item in system.plant.inputs if system.plant is not None else ():
        if item.sensor in pressed:
            buttons.setdefault(item.subsystem, []).append(item.sensor)
    return buttons


WORKER_PERIOD_S = 0.05
"""Subsystems from this period on may compute in a worker thread."""

SWITCH_S = 1e-4
"""How long a worker may keep the interpreter while a control loop waits for it. Python's own 5 ms
are more than two periods of such a loop."""

Readers = dict[str, dict[str, list[Put]]]
"""Subsystem -> output element -> the setters of those who read it."""


def worker_pool(system: System) -> Workers | None:
    """Threads for the slow subsystems, one core left to the others; None if there are none.

    Not in real time: a thread of ordinary priority that is woken waits behind processes that have
    just begun, and one that has computed may still hold the interpreter.
    """
    slow = sum(s.subsystem.period_s >= WORKER_PERIOD_S for s in system.subsystems)
    threads = min(slow, max(1, (os.cpu_count() or 2) - 1))
    if not threads:
        return None
    return Workers(threads)


def switch_often() -> None:
    """Have threads give the interpreter to others soon."""
    sys.setswitchinterval(min(sys.getswitchinterval(), SWITCH_S))


def tracks(
    system: System,
    plant: Plant | None,
    sensors: dict[str, Sensor],
    commands: Commands,
    pool: Workers | None,
    clock: WallClock,
    processes: Processes | None = None,
) -> dict[str, Track]:
    """The tracks by name; raises AttributeError where a buffer lacks a connected element.

    `commands` will have what devices were commanded last.
    """
    readers, ages = _readers(system, plant, commands), ageing(system, sensors)
    built = {}
    for scheduled in system.subsystems:
        subsystem = scheduled.subsystem
        name = subsystem.name
        watch = system.task.watch if system.task and system.task.subsystem == name else ()
        inputs = [i for i in (system.plant.inputs if system.plant else ()) if i.subsystem == name]
        sensed = tuple(i.element for i in inputs)
        worker = processes.get(name) if processes is not None else None
        if worker is None:
            runner = _runner(subsystem, sensed, pool, clock)
        else:
            clear = lower_flags(subsystem.x)
            runner = ProcessRunner(subsystem, sensed, clear, clock, worker)
        ports = [Port(sensors[i.sensor], setter(subsystem.x, i.element)) for i in inputs]
        route = readers[name], tuple(ports), watch
        built[name] = Track(scheduled, runner, *route, ages.get(name))
    return built


def _runner(
    subsystem: Subsystem, sensed: tuple[str, ...], pool: Workers | None, clock: WallClock
) -> Runner:
    clear = lower_flags(subsystem.x)
    if pool is None or subsystem.period_s < WORKER_PERIOD_S:
        return InlineRunner(subsystem, sensed, clear, clock)
    return WorkerRunner(subsystem, sensed, clear, clock, pool)


def _readers(system: System, plant: Plant | None, commands: Commands) -> Readers:
    readers: Readers = defaultdict(lambda: defaultdict(list))
    for item in system.connections:
        inbox = system.scheduled(item.target).subsystem.x
        readers[item.source][item.output].append(setter(inbox, item.input))
    if system.plant is not None and plant is not None:
        for output in system.plant.outputs:
            put = _command(plant, output, commands)
            readers[output.subsystem][output.element].append(put)
    return readers


def _command(plant: Plant, output: PlantOutput, commands: Commands) -> Put:
    """What gives an actuator its command and notes it; raises `DeviceFailed`."""
    actuator, subsystem = output.actuator, output.subsystem

    def put(value: Any) -> None:
        commands[actuator] = subsystem, value
        try:
            plant.actuate(actuator, value)
        except (Fault, KeyboardInterrupt):
            raise
        except BaseException as error:  # whatever the device raises
            raise DeviceFailed(actuator, error, {"command": value}) from error

    return put
