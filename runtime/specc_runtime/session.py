"""A run from the first tick to the report: system, plant, task and companions together."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

from specc_runtime.account import Account
from specc_runtime.changes import PROGRAM, Event
from specc_runtime.clipping import clipped_data
from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion, Recording, View
from specc_runtime.cycle import Executor
from specc_runtime.disturbances import Disturbances
from specc_runtime.faults import Fault, JudgeFailed, PlantFailed
from specc_runtime.forms import Misshapen
from specc_runtime.interruption import Abandoned, Interruption
from specc_runtime.live import Change
from specc_runtime.options import CYCLE_LIMIT_S, Options, UsageError
from specc_runtime.panel import Operation, Panel
from specc_runtime.placement import followed_data
from specc_runtime.plant import Plant
from specc_runtime.processes.worker import Processes
from specc_runtime.punctuality import Punctuality
from specc_runtime.records import Observer
from specc_runtime.report import (
    Ending,
    Report,
    peak_memory_mb,
    subsystem_data,
    versions,
)
from specc_runtime.requirement import Requirement
from specc_runtime.safety import LastOutput
from specc_runtime.savable import restored, saved_by
from specc_runtime.snapshot import Values
from specc_runtime.system import System
from specc_runtime.task import Judge, drawn
from specc_runtime.timing import meeting, timing

if TYPE_CHECKING:
    from specc_runtime.page.feed import Feed

DEFAULT_DURATION_S = 10.0
"""Simulated time of a run of a system without a task."""
_ROUNDING = 1e-6  # times are multiples of a rounded tick


class Session:
    """One run. `interruption` ends it early."""

    def __init__(  # noqa: PLR0913  # each a part of a run
        self,
        options: Options,
        system: System,
        plant: Plant | None,
        judge: Judge | None,
        clock: WallClock,
        interruption: Interruption,
        recorder: Recording | None = None,
        processes: Processes | None = None,
        feed: Feed | None = None,
    ) -> None:
        """The plant is reset and its scene set; a `feed` shows the run.

        Raises ValueError, AttributeError for a system that does not hang together, UsageError for a
        plant that cannot be disturbed as it says.
        """
        self.interruption = interruption
        self.duration_s, self.wanted = _limits(options, system)
        self._options = options
        self._scene = drawn(system.task.starts, options.seed) if system.task else {}
        self._system = system
        self._clock = clock
        self._punctuality = Punctuality(lambda: processes.scheduling if processes else {})
        over, ready = lambda: interruption.requested, self._punctuality.begin
        self._feed = feed
        if feed is None or options.real_time:
            self._timing = timing(options, plant, clock, over, ready)
        else:
            self._timing = feed.timing(clock, over)
        self._wall_s = 0.0
        self._begin_s = clock.now_s()
        self._over_now = False
        self._last_outputs: dict[str, LastOutput] = {}
        self._other_faults: list[Fault] = []
        self._account = Account(system, judge, lambda: self._executor.time_s)
        own: list[Observer] = [] if recorder is None else [recorder]
        own += getattr(plant, "step_observers", ())
        self._executor = Executor(
            system,
            plant,
            (*own, *self._account.observers, *([] if feed is None else [feed])),
            onlooker=self._account.onlooker(
                system, plant, recorder if recorder and recorder.is_whole else None
            ),
            inline=options.inline,
            clock=clock,
            timing=self._timing,
            processes=processes,
            at_rest=self._rest,
            changed=self._changed,
        )
        self._plant = plant
        self._recorder = recorder
        self._snapshot_tick = 0  # the tick of the last snapshot
        disturb = system.task.disturb if system.task else ()
        self._disturbances = Disturbances(
            disturb, system.triggers, plant, self._executor, options.seed
        )
        if feed is not None:
            self._disturbances.on_begin = partial(feed.mark, "disturbance")
        is_ros2 = system.plant is not None and system.plant.ros2 is not None
        self._ros2: Any = plant if is_ros2 and hasattr(plant, "join") else None
        """The plant that others in ROS see the run by, if there is one."""
        if self._ros2 is not None:
            self._ros2.join(self)

    def _rest(self) -> None:
        """Nothing is under way: let the recorder keep all that there is, once."""
        self._account.digest.fold()
        before, self._snapshot_tick = self._snapshot_tick, self._executor.tick
        if self._recorder is not None and self._snapshot_tick > before:
            self._recorder.keep(self._executor.time_s, self.saved)

    def set_constant(self, name: str, value: float, by: str = PROGRAM) -> None:
        """Change a constant that may change (`live`), while the run goes on or before it begins.

        All subsystems see the value from the next base tick on. Any thread may call this.

        Raises ValueError for another constant, and for a value that is not within its range.
        """
        self._executor.set_constant(name, value, by)

    def operate(self, name: str, value: Any) -> None:
        """Operate an element of the panel, while the run goes on or before it begins.

        A button is pressed by true, one that is held until false. Its reader sees it from the next
        base tick on. Any thread may call this.

        Raises ValueError for an element that there is not, and for a value that it does not take.
        """
        self._executor.operate(name, value)

    @property
    def panel(self) -> Panel:
        """The operator's panel."""
        return self._executor.panel

    def schedule(
        self, changes: Sequence[Change], operations: Sequence[Operation], until_s: float
    ) -> None:
        """Do what was done in a recorded run again until then, from where it goes on by itself."""
        self._executor.live.schedule(changes)
        self.panel.schedule(operations, math.ceil(until_s / self._system.tick_s - _ROUNDING))

    def _changed(self, change: Event) -> None:
        if self._recorder is not None:
            self._recorder.changed(change, self._executor.time_s)
        if self._feed is not None:
            self._feed.changed(change, self._executor.time_s)
        if self._ros2 is not None:
            self._ros2.changed(change)

    def saved(self, values: Values) -> dict[str, Any]:
        """A snapshot, plain data; raises NotRecorded for what has none."""
        standing, tick = self._executor.standing, self._executor.tick
        renewed = standing.renewed(tick)
        return {
            **standing.saved(tick, values),
            "time": self._executor.time_s,
            "subsystems": {
                subsystem.name: values.of_subsystem(subsystem, x, entered_s, renewed)
                for subsystem, x, entered_s in standing.inboxes()
            },
            **self._account.saved(values),
            "disturbances": self._disturbances.saved(),
            "scene": self._scene,
            **({"live": self._executor.live.saved()} if self._system.live else {}),
            **({"panel": self.panel.saved()} if self._system.panel else {}),
            "plant": saved_by("the plant", self._plant, is_lenient=values.is_lenient),
        }

    def restore(
        self, saved: Mapping[str, Any], values: Values, *, is_other: bool = False
    ) -> list[str]:
        """Go on from a snapshot, which `is_other` if it is of another specification.

        Gives what of it has no place, or is not in it.

        Raises Misshapen, and LookupError, TypeError, ValueError, for what is no snapshot.
        """
        lost = [f"{n}: there is no such subsystem" for n in saved["subsystems"] if n not in values]
        if len(lost) == len(saved["subsystems"]):
            raise Misshapen(f"it is of another system: it has no step of {self._system.name}")
        self._executor.restore(saved, values)
        stamps = self._executor.standing.stamps
        for scheduled in self._system.subsystems:
            subsystem, name = scheduled.subsystem, scheduled.subsystem.name
            if name in saved["subsystems"]:
                lost += values.place(subsystem, saved["subsystems"][name], stamps[name])
            else:
                lost.append(f"{name}: is at its beginning: it was not recorded")
        lost += self._account.restore(saved, values, self._executor.tick, is_other=is_other)
        if "panel" in saved:
            lost += self.panel.restore(saved["panel"])
        lost += self._disturbances.restore(saved["disturbances"])
        if "live" in saved:
            lost += self._executor.live.restore(saved["live"])
        begun_with = {str(name): float(value) for name, value in saved["scene"].items()}
        if begun_with != self._scene:
            lost.append("the scene is that of the recorded run")
        self._scene = begun_with
        restored("the plant", self._plant, saved["plant"])
        self._disturbances.push_again()
        return [*lost, *dict.fromkeys(values.lost)]

    def stop_from(self, time_s: float) -> None:
        """Ask the formula that ends the run, if there is one, from that simulated time on."""
        if (stop := self._account.stop) is not None:
            stop.asked_from = math.ceil(time_s / self._system.tick_s - _ROUNDING)

    def go_to(self, time_s: float, tick_s: float) -> None:
        """Run to the first moment from then on that is a tick for a base tick of `tick_s`, too.

        What is under way is computed; the others see it when they would have.

        Raises UsageError if a fault ends it before.
        """
        self.duration_s, self.wanted = meeting(time_s, self._system.tick_s, tick_s), None
        self._guarded(lambda: self._advance(()))
        if self.interruption.requested:
            raise KeyboardInterrupt
        if self.faults or not self._executor.part():
            raise UsageError(f"the recorded run ends by a fault: {self.faults[0].message}")
        self._account.digest.fold()

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self._executor.time_s

    def close(self) -> None:
        """End what goes on in other threads, without a word to devices."""
        self._executor.close()

    @property
    def progress(self) -> int:
        """A number that changes as long as the run goes on."""
        return self._executor.tick + self._over_now + (self._feed.beats if self._feed else 0)

    # What a page asks of it, see `specc_runtime.page.feed.Run`.

    @property
    def requirements(self) -> Sequence[Requirement]:
        """All of them."""
        of_system = self._account.requirements
        return of_system.requirements if of_system is not None else ()

    def entered(self) -> dict[str, float]:
        """When each subsystem entered its state."""
        return {each.name: entered_s for each, _, entered_s in self._executor.standing.inboxes()}

    @property
    def live(self) -> Mapping[str, float]:
        """The values of the constants that may change."""
        return self._executor.live.values

    def cycles(self) -> Sequence[Mapping[str, Any]]:
        """Those that are over, as in the report."""
        return self._account.cycles.results

    def late(self) -> Mapping[str, tuple[float, int]]:
        """How late the last step of each subsystem began, in s, and the periods it has skipped."""
        return self._executor.late

    def skipped(self) -> Mapping[str, int]:
        """Periods of each subsystem that are over and in which no step began."""
        return self._executor.skipped

    def ages(self) -> Mapping[str, float]:
        """How long ago the last sample of each sensor was measured, in s; inf of a lost device."""
        return self._executor.ages

    def view(self) -> View:
        """The run as it is now."""
        return View(
            self._executor.time_s,
            self._account.statistics.states,
            tuple(self._account.cycles.fulfilled),
            self.wanted,
            self.duration_s,
        )

    def run(self, companions: Sequence[Companion] = ()) -> None:
        """Run to the end, whatever it is; a fault and Ctrl-C are ends too.

        Wall time counts from when every subsystem has made its first step, with all that it loads.
        """
        self._begin_s = self._clock.now_s()
        self._rest()
        try:
            self._guarded(lambda: self._advance(companions))
            self._guarded(self._executor.finish)
            self._account.finish(self._executor.tick)
        finally:
            self.interruption.allow(always=True)
            self._executor.close()
            self._last_outputs = self._executor.leave_safe()
            self._punctuality.end()
            self._over_now = True
            if self._feed is not None:
                self._feed.rest()
        if self._system.task is not None and self.faults and not self._complete():
            self._guarded(self._end_of_the_last_cycle)
        self._wall_s = self._clock.now_s() - self._begin_s

    def report(self) -> Report:
        """What happened."""
        simulated_s = self._executor.time_s
        wall_s = self._wall_s or self._clock.now_s() - self._begin_s
        busy_s = self._executor.busy_s
        account = self._account
        tallies = account.statistics.tallies
        return Report(
            spec=self._system.spec or self._system.name,
            seed=self._options.seed,
            versions=versions(),
            simulated_s=simulated_s,
            wall_s=wall_s,
            real_time_factor=simulated_s / wall_s if wall_s else 0.0,
            peak_memory_mb=peak_memory_mb(),
            cycles=account.cycles.results,
            subsystems={
                name: subsystem_data(tallies[name], busy_s[name], simulated_s)
                for name in sorted(tallies)
            },
            equations_executed=account.statistics.equations(),
            records_sha256=account.digest.hexdigest(),
            faults=[fault.as_data() for fault in self.faults],
            ended=self._ended(),
            interrupted=self.interruption.requested,
            last_outputs={n: o.as_data() for n, o in sorted(self._last_outputs.items())},
            set=dict(self._options.built_with),
            scene=self._scene,
            requirements=account.requirements.as_data() if account.requirements else [],
            disturbances=self._disturbances.as_data(),
            changes=self._events(self._executor.live.changes),
            panel=self._events(self.panel.operations),
            unobserved=account.unobserved,
            clipped=clipped_data(self._plant, self._system.tick_s),
            other_commanders=self._other_commanders(),
            stop_when=self._stop_data(),
            real_time=followed_data(
                self._system, self._options.apart, self._timing, self._executor, self._punctuality
            ),
        )

    def _events(self, events: Sequence[Event]) -> list[dict[str, Any]]:
        """Entries of the report about what was changed meanwhile."""
        tick_s = self._system.tick_s
        return [event.as_data() | {"time_s": round(event.tick * tick_s, 9)} for event in events]

    def _other_commanders(self) -> dict[str, Any]:
        return {} if self._ros2 is None else dict(self._ros2.other_commanders)

    def _stop_data(self) -> dict[str, Any]:
        """The entry of the report for the formula that ends the run, if there is one."""
        stop = self._account.stop
        if stop is None:
            return {}
        first = stop.held_first
        return {"that": stop.that, "met_s": None if first is None else first * self._system.tick_s}

    def _ended(self) -> Ending:
        if not self._over_now:
            return "running"
        if self.faults:
            return "fault"
        return "interrupted" if self.interruption.requested else "completed"

    @property
    def is_endless(self) -> bool:
        """Whether it goes on until it is stopped, which is no shortfall then."""
        return self.wanted is None and self.duration_s is None

    @property
    def fulfilled(self) -> bool:
        """Whether nothing failed or was violated, and every cycle wanted is fulfilled."""
        enough = self._stopped or (
            self._account.stop is None and (self.wanted is None or self._complete())
        )
        good = enough and all(self._account.cycles.fulfilled)
        return good and not self._account.violated and not self.faults

    def _complete(self) -> bool:
        return self.wanted is not None and len(self._account.cycles.results) >= self.wanted

    @property
    def shortfall(self) -> str:
        """Why what was waited for is not there, cycles or a formula; empty if it is."""
        if (stop := self._account.stop) is not None:
            why = f"within {self.time_s:g} s this never held: {stop.that}"
            return "" if self._stopped or self.faults else why
        results = self._account.cycles.results
        done = len(results)
        if self.faults or self.wanted is None or done >= self.wanted:
            return ""
        cut = results and results[-1]["ended"] == "time limit"
        why = f"one took {self._cycle_limit_s:g} s" if cut else f"{self.duration_s:g} s were over"
        return f"{done} of {self.wanted} cycles when {why}"

    def abandon(self) -> None:
        """Give the plant its safe outputs although a step that does not end is still under way."""
        self._executor.abandon(self.interruption.abandoned())
        if self._account.requirements is not None:
            self._account.requirements.abandon(self._executor.tick)
        self._last_outputs = self._executor.leave_safe()
        self._over_now = True

    def _end_of_the_last_cycle(self) -> None:
        with suppress(JudgeFailed):  # a judge that fails after a fault adds nothing to it
            self._account.cycles.end("fault")

    @property
    def faults(self) -> list[Fault]:
        """What stopped the run."""
        return self._executor.faults + self._other_faults

    def _advance(self, companions: Sequence[Companion]) -> None:
        calls = [(self._ticks(c.period_s), c) for c in companions]
        executor, before = self._executor, self._executor.tick
        while not self._over() and self._disturbed() and executor.advance():
            if executor.tick == 1:
                executor.wait()
                self._begin_s = self._clock.now_s()
            self._account.advance(executor.tick)
            if self._feed is not None:
                self._feed.tick()
            for ticks, companion in calls:
                is_due = executor.tick // ticks > before // ticks
                if is_due and not self._accompanied(companion):
                    calls = [call for call in calls if call[1] is not companion]
            before = executor.tick

    def _disturbed(self) -> bool:
        """Let happen to the plant what is due before this tick; whether that was possible."""
        try:
            self._disturbances.advance(self._executor.time_s)
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # noqa: BLE001  # whatever the user's class raises
            self.note(PlantFailed(error))
            return False
        return True

    def _accompanied(self, companion: Companion) -> bool:
        """Let a companion take note; whether it goes on. One that fails does not end the run."""
        try:
            companion.tick(self.view())
        except (Exception, SystemExit):  # noqa: BLE001  # a closed stream, a graphics system: not the run's
            return False
        return True

    def _over(self) -> bool:
        if self.interruption.requested or self._complete() or self._stopped:
            return True
        if getattr(self._plant, "is_over", False) is True:  # it has only what was recorded
            return True
        if self.duration_s is not None:
            last = math.ceil(self.duration_s / self._system.tick_s - _ROUNDING)
            if self._executor.tick >= last or self.wanted is None:
                return self._executor.tick >= last
        elif self.is_endless:
            return False
        cycles = self._account.cycles
        if self._executor.time_s - cycles.begun_s < self._cycle_limit_s:
            return False
        cycles.end("time limit")
        return True

    @property
    def _stopped(self) -> bool:
        stop = self._account.stop
        return stop is not None and stop.held_first is not None

    @property
    def _cycle_limit_s(self) -> float:
        return self._options.cycle_limit_s or CYCLE_LIMIT_S

    def _ticks(self, period_s: float) -> int:
        return max(1, round(period_s / self._system.tick_s))

    def _guarded(self, part: Callable[[], None]) -> None:
        try:
            part()
        except Fault as fault:
            self.note(fault)
        except (Abandoned, KeyboardInterrupt) as error:
            self.interruption.request()
            self._executor.abandon(error)

    def note(self, fault: Fault) -> None:
        """Add a fault of what goes on around the executor."""
        fault.time_s = fault.time_s or self._executor.time_s
        self._other_faults.append(fault)


def _limits(options: Options, system: System) -> tuple[float | None, int | None]:
    """How long the run is in simulated time, and for how many cycles; neither if it is endless."""
    if options.endless:
        return options.duration_s, options.cycles
    if options.duration_s is None and system.task is None:
        return DEFAULT_DURATION_S, options.cycles
    if options.duration_s is None and options.cycles is None:
        return None, 1
    return options.duration_s, options.cycles
