"""Progress on standard error: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from contextlib import suppress

from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion, View
from specc_runtime.printing import say

BAR_INTERVAL_S = 0.1
LINE_INTERVAL_S = 5.0
"""Wall time between two updates."""
_MUCH = 0.1
"""Part of the wall time from which on it is told what takes it."""


class _Rendering:
    """What films take of the wall time, in words; `busy_s` says how long they have taken."""

    def __init__(self, clock: WallClock, busy_s: Callable[[], float]) -> None:
        self._clock, self._busy_s = clock, busy_s
        self._begin_s = clock.now_s()

    def share(self) -> str:
        """Nothing where it is little."""
        part = self._busy_s() / max(self._clock.now_s() - self._begin_s, 1e-9)
        return f"rendering takes {min(part, 1.0):.0%} of the time" if part >= _MUCH else ""


class Bar:
    """A bar of cycles or of simulated time, with the states of all subsystems."""

    period_s = 0.01

    def __init__(self, clock: WallClock, busy_s: Callable[[], float] = float) -> None:
        # A run that nobody watches begins without what draws the bar.
        from rich.console import Console
        from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn

        self._clock, self._rendering = clock, _Rendering(clock, busy_s)
        self._shown_s = clock.now_s()
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}"),
            BarColumn(bar_width=24),
            TextColumn("{task.fields[time]}  {task.fields[rendering]}  {task.fields[states]}"),
        )
        console = Console(stderr=True)
        self._progress = Progress(*columns, console=console, auto_refresh=False, transient=True)
        self._task = self._progress.add_task("", total=None, time="", rendering="", states="")
        self._progress.start()

    def tick(self, view: View) -> None:
        """See `Companion`."""
        now_s = self._clock.now_s()
        if now_s - self._shown_s >= BAR_INTERVAL_S:
            self._shown_s = now_s
            done, total = _part(view)
            self._progress.update(
                self._task,
                description=_what(view),
                completed=done,
                total=total,
                time=f"{view.time_s:.2f} s",
                rendering=self._rendering.share(),
                states=_states(view),
            )
            with suppress(OSError):  # the terminal was closed: a signal ends the run
                self._progress.refresh()

    def close(self) -> None:
        """See `Companion`."""
        with suppress(OSError):
            self._progress.stop()


class Lines:
    """The same as plain lines, for logs."""

    period_s = 0.1

    def __init__(self, clock: WallClock, busy_s: Callable[[], float] = float) -> None:
        self._clock, self._rendering = clock, _Rendering(clock, busy_s)
        self._shown_s = -math.inf
        self._cycles = 0

    def tick(self, view: View) -> None:
        """See `Companion`."""
        now_s = self._clock.now_s()
        if now_s - self._shown_s >= LINE_INTERVAL_S or len(view.fulfilled) != self._cycles:
            self._shown_s = now_s
            self._cycles = len(view.fulfilled)
            parts = _what(view), f"{view.time_s:.2f} s", self._rendering.share(), _states(view)
            say("  ".join(filter(None, parts)))

    def close(self) -> None:
        """See `Companion`."""


def progress(clock: WallClock, busy_s: Callable[[], float]) -> Companion:
    """What suits standard error; `busy_s` is the wall time that films have taken."""
    return (Bar if sys.stderr.isatty() else Lines)(clock, busy_s)


def _what(view: View) -> str:
    if view.cycles is None:
        done = len(view.fulfilled)
        return f"{done} cycle{'s' * (done > 1)}" if done else "running"
    return f"cycle {min(len(view.fulfilled) + 1, view.cycles)}/{view.cycles}"


def _part(view: View) -> tuple[float, float | None]:
    if view.cycles is not None:
        # One cycle has no measure of its progress: the bar only moves.
        return len(view.fulfilled), view.cycles if view.cycles > 1 else None
    return view.time_s, view.duration_s


def _states(view: View) -> str:
    return "  ".join(f"{name} {state}" for name, state in view.states.items() if state)
