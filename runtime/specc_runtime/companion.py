"""What goes along with a run and never changes it: report, window; also progress and video."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from specc_runtime.changes import Event
from specc_runtime.clock import WallClock
from specc_runtime.records import StepRecord
from specc_runtime.report import Report, write
from specc_runtime.snapshot import Values

INTERVAL_S = 5.0
"""Wall time between two versions of the report."""


class OutputLost(Exception):
    """A file that goes along with a run is missing, or a part of it."""


@dataclass(frozen=True, slots=True)
class View:
    """A run at one moment. `cycles` and `duration_s` are what was asked for, or None."""

    time_s: float
    states: dict[str, str]
    fulfilled: tuple[bool, ...]
    cycles: int | None
    duration_s: float | None


class Recording(Protocol):
    """What records a run: an observer that keeps snapshots."""

    is_whole: bool
    """Whether it wants to see all of the plant that is so in truth."""

    def __call__(self, record: StepRecord) -> None:
        """See `Observer`."""

    def keep(self, time_s: float, saved: Callable[[Values], dict[str, Any]]) -> None:
        """Called now and then between two ticks with what gives a snapshot."""

    def changed(self, change: Event, time_s: float) -> None:
        """Called when a constant changes, and when the panel is operated."""


class Companion(Protocol):
    """Called every `period_s` of simulated time."""

    period_s: float

    def tick(self, view: View) -> None:
        """Take note of the run as it is now."""

    def close(self) -> None:
        """The run is over, one way or another."""


class ReportKeeper:
    """Writes the report at the beginning and from time to time: a run may be killed."""

    period_s = 0.01

    def __init__(self, report: Callable[[], Report], path: Path, clock: WallClock) -> None:
        self._report = report
        self._path = path
        self._clock = clock
        self._write()

    def tick(self, view: View) -> None:
        """See `Companion`."""
        if self._clock.now_s() - self._written_s >= INTERVAL_S:
            self._write()

    def close(self) -> None:
        """See `Companion`."""

    def _write(self) -> None:
        self._written_s = self._clock.now_s()
        with suppress(OSError):  # whether the whole report can be written is told at the end
            write(self._report(), self._path)


class ViewerCompanion:
    """A window on the plant, not faster than real time; closing it ends the run."""

    period_s = 0.02

    def __init__(self, plant: Any, clock: WallClock, stop: Callable[[], None]) -> None:
        """The plant needs `open_viewer()`; what that raises without a display goes through."""
        self._window = plant.open_viewer()
        self._clock = clock
        self._stop = stop
        self._origin_s = clock.now_s()

    def tick(self, view: View) -> None:
        """See `Companion`."""
        if not self._window.is_open:
            self._stop()
            return
        self._window.sync()
        late_s = self._clock.now_s() - self._origin_s - view.time_s
        if late_s > 0.0:
            self._origin_s += late_s  # time that was lost is not caught up
        self._clock.wait(-late_s)

    def close(self) -> None:
        """See `Companion`."""
        self._window.close()
