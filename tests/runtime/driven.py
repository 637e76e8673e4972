"""A clock that the test drives: steps and samples cost what the test says, and nothing else."""

from __future__ import annotations

from collections.abc import Callable

from specc_runtime.clock import WallClock
from specc_runtime.cycle import Executor
from specc_runtime.plant import Plant
from specc_runtime.records import Observer, StepRecord
from specc_runtime.system import System
from specc_runtime.timing import RealTime, Timing
from specc_runtime.track import Outcome, Runner


class DrivenClock(WallClock):
    """Time passes only where somebody waits, or is busy."""

    def __init__(self) -> None:
        self.time_s = 100.0

    def now_s(self) -> float:
        return self.time_s

    def wait(self, duration_s: float) -> None:
        self.time_s += max(0.0, duration_s)

    def busy(self, duration_s: float) -> None:
        """What the main thread does costs so much."""
        self.time_s += duration_s


class Elsewhere(Runner):
    """Steps at once, but the outcome is there only after a while: as if on another core."""

    def __init__(self, runner: Runner, clock: DrivenClock, lasts_s: Callable[[], float]) -> None:
        self._runner, self._driven, self._lasts_s = runner, clock, lasts_s
        self.subsystem, self.inbox, self.busy_s = runner.subsystem, runner.inbox, 0.0
        self._done_s = 0.0

    def start(self, skipped: int = 0) -> None:
        self._runner.start(skipped)
        self._done_s = self._driven.now_s() + self._lasts_s()

    @property
    def is_done(self) -> bool:
        return self._driven.now_s() >= self._done_s

    def outcome(self) -> Outcome:
        self._driven.wait(self._done_s - self._driven.now_s())
        return self._runner.outcome()


class Driven:
    """A run in real time on a driven clock. `begun` has ticks and stamps of all steps by name."""

    def __init__(
        self,
        built: System,
        clock: DrivenClock,
        *,
        elsewhere: dict[str, Callable[[], float]] | None = None,
        timing: Timing | None = None,
        plant: Plant | None = None,
        observers: tuple[Observer, ...] = (),
    ) -> None:
        self.clock = clock
        self.records: list[StepRecord] = []
        self.executor = Executor(
            built,
            plant,
            (self.records.append, *observers),
            inline=True,
            clock=clock,
            timing=timing or RealTime(clock),
        )
        for name, lasts_s in (elsewhere or {}).items():
            track = self.executor._tracks[name]
            track.runner = Elsewhere(track.runner, clock, lasts_s)

    def until(self, tick: int, each: Callable[[], None] = lambda: None) -> Driven:
        """Run to a tick, or a fault; `each` is called between ticks."""
        while self.executor.tick < tick and self.executor.advance():
            each()
        return self

    def finish(self) -> Driven:
        self.executor.finish()
        self.executor.close()
        return self

    def of(self, name: str) -> list[StepRecord]:
        return [record for record in self.records if record.subsystem == name]
