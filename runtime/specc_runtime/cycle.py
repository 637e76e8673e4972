"""The executor: the work cycle of all subsystems over base ticks, with logical execution time.

What a subsystem computes at its time stamp i becomes visible at its time stamp i + 1, so neither
the order of subsystems nor the speed of the machine can be seen in a run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, cast

from specc_runtime.between_steps import Standing
from specc_runtime.blame import Blame
from specc_runtime.buffers import slots
from specc_runtime.changes import PROGRAM, TASK, Event
from specc_runtime.clock import WallClock
from specc_runtime.distortion import Distortable, Distortion
from specc_runtime.examination import shortcomings
from specc_runtime.faults import Fault, StepAbandoned
from specc_runtime.live import LiveConstants
from specc_runtime.panel import Panel
from specc_runtime.plant import Plant
from specc_runtime.processes.worker import Processes
from specc_runtime.records import Observer
from specc_runtime.safety import Commands, LastOutput, hand_over, leave_safe
from specc_runtime.sampling import Onlooker, Sensor
from specc_runtime.schedule import Due
from specc_runtime.snapshot import Values
from specc_runtime.subsystem import contents
from specc_runtime.system import System
from specc_runtime.timing import Quantiles, RealTime, SimulatedTime, Timing
from specc_runtime.track import Track
from specc_runtime.watchdog import frames_of, left
from specc_runtime.wiring import (
    buttons_read,
    sensor_rates,
    sensors_read,
    switch_often,
    timeline,
    tracks,
    worker_pool,
)

Mark = tuple[int, Commands, list[tuple[object, dict[str, Any]]]]
"""A moment of a run: its tick, the last commands, and what each part held, none of it copied."""
REST_S = 1.0

_ROUNDING = 1e-6  # times are multiples of a rounded tick


class Executor:
    """Runs a built system, once. `tick` counts base ticks, `faults` is what stopped the run."""

    def __init__(  # noqa: PLR0913  # keywords, each a part of a run
        self,
        system: System,
        plant: Plant | None = None,
        observers: Iterable[Observer] = (),
        *,
        onlooker: Onlooker | None = None,
        inline: bool = False,
        clock: WallClock | None = None,
        timing: Timing | None = None,
        processes: Processes | None = None,
        at_rest: Callable[[], None] = lambda: None,
        changed: Callable[[Event], None] = lambda _: None,
    ) -> None:
        """`plant` must be there, and reset, if the system needs one; `inline` forbids threads.

        `processes` compute some of the subsystems. `timing` says how the ticks follow a clock;
        without one time is simulated. `at_rest` is called about every `REST_S` of simulated time,
        when nothing is under way, `changed` with each change of a constant that may change and each
        operation of the panel.

        Raises ValueError if it is not, or lacks a method that the run calls, and for real time with
        code that does not test all rows.
        """
        _check(system, plant)
        if isinstance(timing, RealTime) and not system.tests_all_rows:
            raise ValueError(
                f"the code of system {system.name!r} relies on proofs that hold where no period is "
                "skipped; build it with --real-time"
            )
        self.tick = 0
        self.faults: list[Fault] = []
        self._abandoned = False
        self._tick_s = system.tick_s
        self._timing = timing or SimulatedTime()
        self._real = self._timing if isinstance(self._timing, RealTime) else None
        self._is_timed = self._timing.is_free
        self._plant = plant
        self._onlooker = onlooker
        self._observers = tuple(observers)
        self._rates = rates = sensor_rates(system)
        clock = clock or WallClock()
        self.panel = Panel(system.panel, clock)
        self._sensors = sensors_read(system, plant, self.panel, rates, self._now_s)
        self._safe = system.plant.safe if system.plant else ()
        hand_over(self._safe, plant, self._sensors, clock)
        self._commands: Commands = {}
        due = timeline({s.subsystem.name: s.ticks for s in system.subsystems}, rates)
        self._pool = None if inline or self._real else worker_pool(system)
        if self._real or self._pool:
            switch_often()
        self._processes = processes
        self._tracks = tracks(
            system,
            plant,
            self._sensors,
            self._commands,
            self._pool,
            clock,
            processes,
        )
        if self._real is not None:
            for track in self._tracks.values():
                track.runner.begins = partial(_note_begin, track, self._real)
        self._ages = any(track.ageing is not None for track in self._tracks.values())
        self._blame = Blame(system, self._tracks)
        self._due = Due(due, self._tracks, self._sensors, system.tick_s)
        self._at_rest = at_rest
        inboxes = {name: track.runner.inbox for name, track in self._tracks.items()}
        self.live = LiveConstants(system.live, inboxes)
        self._buttons = buttons_read(system)
        self._changed = changed
        self._rest = len(due) * max(1, round(REST_S / (len(due) * self._tick_s)))

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.tick * self._tick_s

    def _now_s(self) -> float:
        """Time since tick 0, by the clock in real time."""
        return self.time_s if self._real is None else self._real.now_s

    @property
    def skipped(self) -> dict[str, int]:
        """Periods of each subsystem in which no step began, but for those that are not over."""
        return {
            name: track.skipped + max(0, track.skipped_until(self.tick - 1))
            for name, track in self._tracks.items()
        }

    @property
    def first_skipped(self) -> tuple[str, int, float] | None:
        """The first period in which no step began: subsystem, stamp and time; None without one."""
        found = []
        for track in self._tracks.values():
            stamp = track.first_skipped
            if stamp is None and track.skipped_until(self.tick - 1) > 0:
                stamp = track.stamp + 1
            if stamp is not None:
                found.append((stamp * track.ticks * self._tick_s, track.name, stamp))
        time_s, name, stamp = min(found, default=(0.0, "", -1))
        return (name, stamp, time_s) if name else None

    @property
    def busy_s(self) -> dict[str, float]:
        """Wall time spent in the steps of each subsystem."""
        return {name: track.runner.busy_s for name, track in self._tracks.items()}

    @property
    def durations(self) -> dict[str, Quantiles]:
        """Of the steps of each subsystem in a run in real time, but for the first ones."""
        every = {name: track.runner.durations for name, track in self._tracks.items()}
        return {name: durations for name, durations in every.items() if durations is not None}

    @property
    def lateness(self) -> dict[str, Quantiles]:
        """How late the periods of each subsystem are in a run in real time, but for the first."""
        until = self.tick - 1, self._now_s(), self._tick_s
        return {name: track.late_until(*until) for name, track in self._tracks.items()}

    @property
    def late(self) -> dict[str, tuple[float, int]]:
        """How late the last step of each subsystem began by the clock, in s, and its `skipped`."""
        begun = (
            (name, t.began_s - t.stamp * t.ticks * self._tick_s) for name, t in self._tracks.items()
        )
        return {name: (max(late_s, 0.0), self._tracks[name].skipped) for name, late_s in begun}

    @property
    def ages(self) -> dict[str, float]:
        """How long ago the last sample of each sensor was measured, in s; inf of a lost device."""
        now_s, sensors = self._now_s(), self._sensors.items()
        return {
            name: math.inf if sensor.is_lost else max(0.0, now_s - sensor.measured_s)
            for name, sensor in sensors
            if sensor.count
        }

    def advance(self) -> bool:
        """One base tick: commit, sample, step, let the plant move.

        False after a fault, and if the run has ended before the tick was due.

        In real time it is the newest one that is due; those before it are skipped.
        """
        tick = self._timing.next(self.tick)
        if self._timing.is_over():
            return False
        real = self._real
        due, sensors = self._due.after_gap(self.tick, tick) if real else self._due.at(tick)
        gap, self.tick = tick - self.tick, tick
        if (gap and not self._could(lambda: self._let_pass(gap))) or not self._all_done(due):
            return False
        if tick % self._rest == 0 and not (real and self._under_way):
            self._at_rest()
        if not self._could(lambda: self._begin(due, sensors)):
            return False
        self.tick = tick + 1
        if not self._is_timed:
            self.wait()  # what a first step loads is not part of any period
            for track in self._tracks.values() if self._real else ():
                track.runner.durations, track.lateness = Quantiles(), Quantiles()
            self._timing.begin(tick, self._tick_s)
            self._is_timed = True
        return True

    def _could(self, ask_plant: Callable[[], None]) -> bool:
        """Whether the plant could do that; whatever it raises is a fault."""
        try:
            ask_plant()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001  # as said
            self.faults.append(self._blame.of_plant(error, self.time_s))
            return False
        return True

    def _let_pass(self, ticks: int) -> None:
        if self._plant is not None:
            self._plant.advance(ticks * self._tick_s)

    def _begin(self, due: Iterable[Track], sensors: Iterable[Sensor]) -> None:
        """Sample, begin the steps that are due and let a tick pass; raises what a plant raises."""
        time_s = self.time_s
        for change in (*self.live.begin(self.tick), *self.panel.begin(self.tick)):
            self._changed(change)
        for sensor in sensors:
            sensor.update(time_s)
        if self._onlooker is not None:
            self._onlooker.look(self.tick, time_s)
        for track in due:
            for port in track.ports:
                port.deliver()
            self.live.deliver(track.name)
        self._start(due)
        self._let_pass(1)

    def _start(self, due: Iterable[Track]) -> None:
        """Begin the steps; in real time but for those that would be too close to the last one."""
        tick, real = self.tick, self._real
        to_come = {track.name for track in due} if self._ages else set()
        told_late: set[str] = set()

        def late(sender: str) -> int:
            track = self._tracks[sender]
            if sender in to_come and (real is None or self._due.is_apart(track, real.now_s)):
                return 0
            told_late.add(sender)  # so it begins none later in this tick
            return track.skipped_until(tick)

        for track in due:
            to_come.discard(track.name)
            if real is not None:
                now_s = real.now_s
                if track.name in told_late or not self._due.is_apart(track, now_s):
                    continue
                track.note_late(tick, now_s, self._tick_s)
            if track.ageing is not None:
                track.ageing.begin(tick, late)
            track.start(tick)
            for button in self._buttons.get(track.name, ()):
                self.panel.was_read(button)

    def settle(self) -> bool:
        """Commit the steps that are due now. False after a fault."""
        return self._all_done(self._due.at(self.tick)[0])

    def _all_done(self, due: Iterable[Track]) -> bool:
        for track in due:
            if track.pending or track.late:
                self._commit(track, self.tick)
        return not self.faults

    def part(self) -> bool:
        """Commit what is due now and, before others may see it, all else that is under way.

        False after a fault. The run does not go on.
        """
        self.settle()
        for track in self._under_way:
            if track.pending:
                self._commit(track, is_early=True)
        return not self.faults

    @property
    def standing(self) -> Standing:
        """What goes on between the subsystems, while no step is under way."""
        return Standing(self._tracks, self._sensors, self._rates, self._commands, self._tick_s)

    def restore(self, saved: Any, values: Values) -> None:
        """Go on from there, with the devices that there are, whose values are of their types now.

        Raises LookupError, TypeError, ValueError for other data.
        """
        self.tick, commands = self.standing.restore(saved, values)
        for name, value in commands.items():
            if self._plant is not None:
                self._plant.actuate(name, value)

    def mark(self) -> Mark:
        """This moment, between two ticks of a run without workers."""
        parts: list[object] = [*self._sensors.values()]
        for track in self._tracks.values():
            subsystem = track.runner.subsystem
            parts += [track, track.runner, *track.ports, *([track.ageing] if track.ageing else [])]
            parts += [subsystem, subsystem.x, subsystem.y, subsystem.memory]
        return self.tick, dict(self._commands), [(part, contents(part)) for part in parts]

    def go_back(self, mark: Mark) -> None:
        """Go on from there, as often as one likes; the plant is not told."""
        self.tick, commands, parts = mark
        self.faults.clear()
        self._abandoned = False
        self._commands.clear()
        self._commands.update(commands)
        for part, state in parts:
            for name in slots(part):
                if name in state:
                    setattr(part, name, state[name])
                elif hasattr(part, name):
                    delattr(part, name)

    def set_constant(self, name: str, value: float, by: str = PROGRAM) -> None:
        """Change a constant that may change; all subsystems see it from the next base tick on.

        Raises ValueError for another constant, and for a value that is not within its range.
        """
        self.live.ask(name, value, by)

    def adjust(self, values: Mapping[str, float]) -> None:
        """Change constants as the task says."""
        for name, value in values.items():
            self.live.ask(name, self.live.whole(name, value), TASK)

    def operate(self, name: str, value: Any) -> None:
        """Operate an element of the panel; its reader sees it from the next base tick on.

        Raises ValueError for an element that there is not, and for a value that it does not take.
        """
        self.panel.operate(name, value)

    def turn(self, values: Mapping[str, float]) -> None:
        """Turn elements of the panel as the task says."""
        for name, value in values.items():
            self.panel.operate(name, self.panel.elements[name].of_number(value), TASK)

    def press(self, names: Iterable[str]) -> None:
        """Press buttons once as the task says, but for those that are held."""
        for name in names:
            if not self.panel.elements[name].hold:
                self.panel.operate(name, True, TASK)

    def hold(self, name: str, is_held: bool) -> None:
        """Hold a button as the task says from now on, or not any more."""
        self.panel.hold_by_task(name, is_held)

    def silence(self, element: str, silent: bool) -> None:
        """Let an element of a device have no samples from now on, or have them again."""
        if element in self._sensors:
            self._sensors[element].silent = silent

    def distort(self, element: str, distortion: Distortion | None) -> None:
        """Distort what is measured for an element of a device from now on, or not any more."""
        if element not in self._sensors:
            return
        # Of a simulated cell, only the simulation may do that itself.
        plant = getattr(self._plant, "behind", lambda _: self._plant)(element)
        if shortcomings(plant, Distortable):
            self._sensors[element].distortion = distortion
        else:
            cast(Distortable, plant).distort(element, distortion)

    def wait(self) -> None:
        """Wait for the steps that are under way, which become visible when they are due."""
        for track in self._tracks.values():
            if track.pending:
                track.runner.outcome()

    def finish(self) -> None:
        """Wait for the steps that are under way and commit them in the order of their time."""
        for track in self._under_way:
            if self._abandoned:
                return
            self._commit(track, max(track.visible_tick, track.next_tick(self.tick)))

    @property
    def _under_way(self) -> list[Track]:
        """Those whose last step the others have not seen, in the order in which they may."""
        found = [track for track in self._tracks.values() if track.pending or track.late]
        return sorted(found, key=lambda track: (track.visible_tick, track.name))

    def abandon(self, error: BaseException) -> None:
        """Treat the steps that are under way as failed and wait for none, because of this error."""
        if self._abandoned:
            return
        self._abandoned = True
        for track in self._tracks.values():
            subsystem = track.runner.subsystem
            elsewhere = track.runner.left(error)
            fault = left(subsystem, error) if frames_of(subsystem) else elsewhere
            if fault is not None:
                self.faults.append(self._blame.of_step(fault, track, self._tick_s))

    def close(self) -> None:
        """End the worker threads, once what they do is done, and processes at once."""
        if self._pool is not None:
            self._pool.close()
        if self._processes is not None:
            self._processes.close()

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

    def _commit(self, track: Track, at: int | None = None, *, is_early: bool = False) -> None:
        try:
            if not track.pending:
                track.show()
                return
            record = track.commit(self._tick_s, at, is_early=is_early)
            for observe in self._observers:
                observe(record)
            if track.ageing is not None and track.ageing.fault is not None:
                raise track.ageing.fault
        except Fault as fault:
            self._abandoned |= isinstance(fault, StepAbandoned)
            self.faults.append(self._blame.of_step(fault, track, self._tick_s))


def _note_begin(track: Track, real: RealTime) -> None:
    """Right before a step, for the process may be stopped between the decision and the step."""
    track.began_s = real.now_s


def _check(system: System, plant: Plant | None) -> None:
    """Raises ValueError for a plant that a system does not have, or that is none."""
    if system.needs_plant != (plant is not None):
        what = "no devices, but was given" if plant else "devices, but was given no"
        raise ValueError(f"system {system.name!r} has {what} plant")
    if plant is not None and (lacking := shortcomings(plant, Plant)):
        raise ValueError(f"the plant, a {type(plant).__name__}, {'; '.join(lacking)}")
