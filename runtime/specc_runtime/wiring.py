"""From a built system to its tracks: every connection, sensor and actuator becomes a setter."""

from __future__ import annotations

import os
from collections import defaultdict
from concurrent.futures import Executor as Pool
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from specc_runtime.buffers import FRESH, PRESENT, Put, lower_flags, sender, setter, slots
from specc_runtime.clock import WallClock
from specc_runtime.plant import Plant
from specc_runtime.runner import InlineRunner, Runner, WorkerRunner
from specc_runtime.sampling import Port, Sensor
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System
from specc_runtime.track import Track

WORKER_PERIOD_S = 0.05
"""Subsystems from this period on may compute in a worker thread."""

Readers = dict[tuple[str, str], list[Put]]
"""(subsystem, output element) -> the setters of those who read it."""


def worker_pool(system: System) -> ThreadPoolExecutor | None:
    """Threads for the slow subsystems, one core left to the others; None if there are none."""
    slow = sum(s.subsystem.period_s >= WORKER_PERIOD_S for s in system.subsystems)
    threads = min(slow, max(1, (os.cpu_count() or 2) - 1))
    return ThreadPoolExecutor(threads, thread_name_prefix="specc-step") if threads else None


def tracks(
    system: System,
    plant: Plant | None,
    sensors: dict[str, Sensor],
    pool: Pool | None,
    clock: WallClock,
) -> dict[str, Track]:
    """The tracks by name; raises AttributeError where a buffer lacks a connected element."""
    readers = _readers(system, plant)
    built = {}
    for scheduled in system.subsystems:
        subsystem = scheduled.subsystem
        name = subsystem.name
        send = {
            state: sender(elements, [readers[name, element] for element in elements])
            for state, elements in subsystem.sends.items()
        }
        watch = system.task.watch if system.task and system.task.subsystem == name else ()
        runner = _runner(subsystem, pool, clock)
        built[name] = Track(scheduled, runner, send, _ports(system, subsystem, sensors), watch)
    return built


def without_source(system: System) -> list[str]:
    """`subsystem: element` of every input that has no value and that nothing writes."""
    written = {(item.target, item.input) for item in system.connections}
    if system.plant is not None:
        written |= {(item.subsystem, item.element) for item in system.plant.inputs}
    return [
        f"{subsystem.name}: {element}"
        for subsystem in (scheduled.subsystem for scheduled in system.subsystems)
        for element in slots(subsystem.x)
        if not element.startswith((FRESH, PRESENT))
        and (subsystem.name, element) not in written
        and not hasattr(subsystem.x, element)
    ]


def _runner(subsystem: Subsystem, pool: Pool | None, clock: WallClock) -> Runner:
    clear = lower_flags(subsystem.x)
    if pool is None or subsystem.period_s < WORKER_PERIOD_S:
        return InlineRunner(subsystem, clear, clock)
    return WorkerRunner(subsystem, clear, clock, pool)


def _readers(system: System, plant: Plant | None) -> Readers:
    readers: Readers = defaultdict(list)
    for item in system.connections:
        inbox = system.scheduled(item.target).subsystem.x
        readers[item.source, item.output].append(setter(inbox, item.input))
    if system.plant is not None and plant is not None:
        for output in system.plant.outputs:
            put = partial(plant.actuate, output.actuator)
            readers[output.subsystem, output.element].append(put)
    return readers


def _ports(system: System, subsystem: Subsystem, sensors: dict[str, Sensor]) -> tuple[Port, ...]:
    inputs = system.plant.inputs if system.plant else ()
    return tuple(
        Port(sensors[item.sensor], setter(subsystem.x, item.element))
        for item in inputs
        if item.subsystem == subsystem.name
    )
