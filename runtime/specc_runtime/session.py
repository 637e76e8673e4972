"""A run from the first tick to the report: system, plant, task and companions together."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion, View
from specc_runtime.cycle import Executor
from specc_runtime.cycles import Cycles
from specc_runtime.interruption import Interruption
from specc_runtime.options import Options
from specc_runtime.plant import Plant
from specc_runtime.plants.errors import PlantError
from specc_runtime.records import RecordDigest
from specc_runtime.report import Report, peak_memory_mb, subsystem_data, versions
from specc_runtime.statistics import Statistics
from specc_runtime.system import System
from specc_runtime.task import Judge

CYCLE_LIMIT_S = 120.0
"""Simulated time after which a cycle is given up."""
DEFAULT_DURATION_S = 10.0
"""Simulated time of a run of a system without a task."""


class Session:
    """One run. `interruption` ends it early."""

    def __init__(
        self,
        options: Options,
        system: System,
        plant: Plant | None,
        judge: Judge | None,
        clock: WallClock,
    ) -> None:
        """The plant is reset and its scene set. Raises ValueError, AttributeError for a system
        that does not hang together.
        """
        self.interruption = Interruption()
        self.duration_s = options.duration_s
        self.wanted = options.cycles
        if self.duration_s is None and system.task is None:
            self.duration_s = DEFAULT_DURATION_S
        elif self.duration_s is None and self.wanted is None:
            self.wanted = 1
        self._seed = options.seed
        self._system = system
        self._judge = judge
        self._clock = clock
        self._wall_s = 0.0
        self._plant_errors: list[dict[str, Any]] = []
        self._statistics = Statistics(system)
        self._digest = RecordDigest()
        self._cycles = Cycles(system, judge, lambda: self._executor.time_s)
        observers = (self._digest, self._statistics, self._cycles)
        self._executor = Executor(system, plant, observers, inline=options.inline, clock=clock)

    def view(self) -> View:
        """The run as it is now."""
        return View(
            self._executor.time_s,
            self._statistics.states,
            tuple(self._cycles.fulfilled),
            self.wanted,
            self.duration_s,
        )

    def run(self, companions: Sequence[Companion] = ()) -> None:
        """Run to the end, whatever it is; a fault, a plant's error and Ctrl-C are ends too."""
        begin_s = self._clock.now_s()
        try:
            with self.interruption:
                self._guarded(lambda: self._advance(companions))
                self._guarded(self._executor.finish)
        finally:
            self._executor.close()
            self._wall_s = self._clock.now_s() - begin_s
        if self._system.task is not None and self._faults() and not self._complete():
            self._cycles.end("fault")

    def report(self) -> Report:
        """What happened."""
        simulated_s = self._executor.time_s
        busy_s = self._executor.busy_s
        tallies = self._statistics.tallies
        return Report(
            spec=self._system.spec or self._system.name,
            seed=self._seed,
            versions=versions(),
            simulated_s=simulated_s,
            wall_s=self._wall_s,
            real_time_factor=simulated_s / self._wall_s if self._wall_s else 0.0,
            peak_memory_mb=peak_memory_mb(),
            cycles=self._cycles.results,
            subsystems={n: subsystem_data(tallies[n], busy_s[n]) for n in sorted(tallies)},
            equations_executed=self._statistics.equations(),
            records_sha256=self._digest.hexdigest(),
            faults=self._faults(),
            interrupted=self.interruption.requested,
        )

    @property
    def fulfilled(self) -> bool:
        """Whether nothing failed and every cycle that was wanted is fulfilled."""
        enough = self.wanted is None or self._complete()
        return enough and all(self._cycles.fulfilled) and not self._faults()

    def _complete(self) -> bool:
        return self.wanted is not None and len(self._cycles.results) >= self.wanted

    def _faults(self) -> list[dict[str, Any]]:
        return [fault.as_data() for fault in self._executor.faults] + self._plant_errors

    def _advance(self, companions: Sequence[Companion]) -> None:
        calls = [(self._ticks(c.period_s), c.tick) for c in companions]
        judge, executor = self._judge, self._executor
        while not self._over() and executor.advance():
            if judge is not None:
                judge.observe()
            for ticks, call in calls:
                if executor.tick % ticks == 0:
                    call(self.view())

    def _over(self) -> bool:
        if self.interruption.requested:
            return True
        if self.duration_s is not None:
            return self._executor.tick >= math.ceil(self.duration_s / self._system.tick_s - 1e-6)
        if self._complete():
            return True
        if self._executor.time_s - self._cycles.begun_s < CYCLE_LIMIT_S:
            return False
        self._cycles.end("time limit")
        return True

    def _ticks(self, period_s: float) -> int:
        return max(1, round(period_s / self._system.tick_s))

    def _guarded(self, part: Any) -> None:
        try:
            part()
        except PlantError as error:
            self._plant_errors.append(
                {
                    "fault": type(error).__name__,
                    "subsystem": "",
                    "state": "",
                    "stamp": -1,
                    "time_s": self._executor.time_s,
                    "message": str(error),
                }
            )
